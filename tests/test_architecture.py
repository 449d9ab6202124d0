"""Data flows one way: the rooms' import table, read off the syntax trees (imports inside functions count)."""

import ast
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.architecture_picture import PICTURE, picture

PACKAGE = Path(__file__).parents[1] / "groundstation"

MAY_IMPORT: dict[str, set[str]] = {
    "base": set(),
    "store": {"base"},
    "readers": {"base", "store"},
    "integrity": {"base"},
    "tables": {"base"},
    "results": {"base"},
    "chapters": {"base", "results"},
    "estimators": {"base", "tables", "results"},
    "simulation": {"base", "tables", "readers"},
    "studies": {"base", "tables", "results", "estimators", "simulation"},
    "viewer": {"base", "tables", "results", "chapters"},
    "reports": {"base", "tables", "results", "chapters"},
    "exports": {"base", "readers", "tables", "results"},
    "pipeline": {
        *("base", "readers", "store", "integrity", "tables", "results"),
        *("chapters", "estimators", "simulation", "studies", "viewer", "reports", "exports"),
    },
    "cli": {"base", "results", "chapters", "pipeline"},
}
PARTS_OF_THE_PIPELINE = ("one_flight", "many_flights", "verbs", "")  # each imports those before it; "": the Python API
ONLY_ROOM_OF = {"mcap": "store", "google": "store", "foxglove_schemas_protobuf": "store", "rerun": "viewer"}
ONLY_ROOM_OF |= {"AcraNetwork": "tests", "chapter10": "tests"}  # oracles; the first is GPL


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else ""


def imports_of(tree: ast.AST) -> list[tuple[str, int]]:
    found: list[tuple[str, int]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            found.append((node.module or "", node.lineno))
            if node.module == "groundstation":
                found += [(f"groundstation.{alias.name}", node.lineno) for alias in node.names]
    return found


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_room_imports_only_what_it_may(path: Path) -> None:
    room = room_of(path)
    for name, line in imports_of(ast.parse(path.read_text(encoding="utf-8"))):
        top, _, rest = name.partition(".")
        if top == "groundstation" and rest and room:
            other = rest.partition(".")[0]
            if other.startswith("__"):
                continue
            assert other == room or other in MAY_IMPORT[room], f"{path.name}:{line}: {room} imports {name}"
        owner = ONLY_ROOM_OF.get(top)
        assert owner is None or owner == room, f"{path.name}:{line}: only {owner}/ imports {top}"


@pytest.mark.parametrize("path", sorted((PACKAGE / "pipeline").rglob("*.py")), ids=lambda path: path.stem)
def test_part_of_the_pipeline_imports_only_those_before_it(path: Path) -> None:
    part = path.parent.name if path.parent.name != "pipeline" else ""
    for name, line in imports_of(ast.parse(path.read_text(encoding="utf-8"))):
        if name.startswith("groundstation.pipeline."):
            parts = name.split(".")
            other = parts[2] if parts[2] in PARTS_OF_THE_PIPELINE else ""
            place = PARTS_OF_THE_PIPELINE.index
            assert place(other) <= place(part), f"{path.name}:{line}: {part} imports {name}"


def test_every_room_is_in_the_table() -> None:
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir() and any(path.glob("*.py"))}
    assert rooms <= set(MAY_IMPORT)


def test_package_imports_nothing_at_module_level() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    assert not [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]


def test_numba_is_imported_by_its_one_wrapper_alone() -> None:
    for path in modules():
        names = {name.partition(".")[0] for name, _ in imports_of(ast.parse(path.read_text(encoding="utf-8")))}
        assert "numba" not in names or path == PACKAGE / "base" / "compile.py", path


def test_no_file_imports_itself_through_others() -> None:
    """An import circle is one file in several: whoever changes one has to read all of them."""
    files = {_name(path): path for path in modules()}
    graph = {name: _imported(path, files) - {name} for name, path in files.items()}
    left = dict(graph)
    while removable := [name for name, imported in left.items() if not imported & left.keys()]:
        for name in removable:
            del left[name]
    assert not left, f"in or behind an import circle: {', '.join(sorted(left))}"


def _name(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(path: Path, files: Mapping[str, Path]) -> set[str]:
    """Files that a file imports; ``from a import b`` means the file a.b where there is one, else a."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.update(
                name if (name := f"{node.module}.{alias.name}") in files else node.module or "" for alias in node.names
            )
    return found & files.keys()


def test_picture_of_the_rooms_is_fresh() -> None:
    assert PICTURE.read_text(encoding="utf-8") == picture(), "python -m tests.architecture_picture draws it again"
