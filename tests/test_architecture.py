"""Data flows one way: the rooms' import table, read off the syntax trees (imports inside functions count)."""

import ast
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest

from tests.architecture_picture import PACKAGE, PICTURE, import_nodes, picture

MAY_IMPORT: dict[str, set[str]] = {
    "base": set(),
    "store": {"base"},
    "readers": {"base", "store"},
    "integrity": {"base"},
    "tables": {"base"},
    "results": {"base"},
    "plots": {"base", "results"},
    "chapters": {"base", "results", "plots"},
    "methods": {"base", "tables", "results"},
    "estimators": {"base", "tables", "results", "methods", "systems"},
    "systems": {"base", "tables", "results", "plots", "chapters", "methods", "estimators", "studies", "viewer"},
    "simulation": {"base", "tables", "readers"},
    "studies": {"base", "tables", "results", "chapters", "methods", "estimators", "simulation", "systems"},
    "viewer": {"base", "tables", "results", "plots", "chapters", "systems"},
    "reports": {"base", "tables", "results", "plots", "chapters", "systems"},
    "exports": {"base", "readers", "tables", "results"},
    "pipeline": {
        *("base", "readers", "store", "integrity", "tables", "results"),
        *(
            "plots",
            "chapters",
            "methods",
            "estimators",
            "simulation",
            "studies",
            "systems",
            "viewer",
            "reports",
            "exports",
        ),
    },
    "cli": {"base", "results", "chapters", "pipeline"},
}
PARTS_OF_THE_PIPELINE = ("one_flight", "many_flights", "verbs", "")  # each imports those before it; "": the Python API
SYSTEM_OF = {"installation": "heading", "two_clocks": "together"}  # folders of one system; else each is one
FLOORS_OF_MANY_FLIGHTS = 5
ONLY_ROOM_OF = {"mcap": "store", "google": "store", "foxglove_schemas_protobuf": "store", "rerun": "viewer"}
NOT_PUBLIC = re.compile(r"/?(rerun_|rerun-[a-z]+-|re_viewer|RERUN_|rerun\.(.*\.)?_)")
OF_TUPLES = ("_replace", "_fields", "_asdict", "_make")  # public methods of named tuples, which cannot have others
ONLY_ROOM_OF |= {"AcraNetwork": "tests", "chapter10": "tests"}  # oracles; the first is GPL


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else ""


@cache
def imports_of(path: Path) -> list[tuple[str, int]]:
    found: list[tuple[str, int]] = []
    for node in import_nodes(path):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            found.append((node.module or "", node.lineno))
            if node.module == "groundstation":
                found += [(f"groundstation.{alias.name}", node.lineno) for alias in node.names]
    return found


@pytest.mark.parametrize("room", ["", *MAY_IMPORT])
def test_room_imports_only_what_it_may(room: str) -> None:
    forbidden = []
    for path in (path for path in modules() if room_of(path) == room):
        for name, line in imports_of(path):
            top, _, rest = name.partition(".")
            other = rest.partition(".")[0]
            is_foreign = top == "groundstation" and room and other and not other.startswith("__") and other != room
            if is_foreign and other not in MAY_IMPORT[room]:
                forbidden.append(f"{path}:{line}: {room} imports {name}")
            if ONLY_ROOM_OF.get(top, room) != room:
                forbidden.append(f"{path}:{line}: only {ONLY_ROOM_OF[top]}/ imports {top}")
    assert not forbidden


def test_part_of_the_pipeline_imports_only_those_before_it() -> None:
    forbidden, place = [], PARTS_OF_THE_PIPELINE.index
    for path in (PACKAGE / "pipeline").rglob("*.py"):
        below = path.relative_to(PACKAGE / "pipeline").parts
        part = below[0] if len(below) > 1 else ""
        for name, line in imports_of(path):
            if name.startswith("groundstation.pipeline."):
                parts = name.split(".")
                other = parts[2] if parts[2] in PARTS_OF_THE_PIPELINE else ""
                if place(other) > place(part):
                    forbidden.append(f"{path}:{line}: {part or 'the Python API'} imports {name}")
    assert not forbidden


def test_every_room_is_in_the_table() -> None:
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir() and any(path.glob("*.py"))}
    assert rooms <= set(MAY_IMPORT)


def test_package_imports_nothing_at_module_level() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    assert not [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]


def test_numba_is_imported_by_its_wrapper_alone() -> None:
    for path in modules():
        names = {name.partition(".")[0] for name, _ in imports_of(path)}
        assert "numba" not in names or path == PACKAGE / "base" / "compile.py", path


def test_matplotlib_is_imported_where_notebooks_are_painted_alone() -> None:
    for path in modules():
        names = {name.partition(".")[0] for name, _ in imports_of(path)}
        assert "matplotlib" not in names or path.parent == PACKAGE / "reports" / "notebook", path


def test_what_of_rerun_is_not_public_stands_in_one_file() -> None:
    """Modules beside ``rerun`` and their files, and underscored names of objects that are not of this package."""
    found: dict[Path, set[str]] = {}
    for path in modules():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        names = {name for name, _ in imports_of(path) if NOT_PUBLIC.match(name)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
                names |= {node.value} if NOT_PUBLIC.match(node.value) else set()
            elif isinstance(node, ast.Attribute) and room_of(path) == "viewer" and node.attr not in OF_TUPLES:
                is_own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
                names |= {node.attr} if re.match("_[a-z]", node.attr) and not is_own else set()
        if names:
            found[path] = names
    inner = PACKAGE / "viewer" / "inner.py"
    assert found.keys() == {inner}, found
    assert {"rerun_bindings", "_from_native", "rerun_cli", "/re_viewer.js"} <= found[inner]


def test_no_system_imports_another() -> None:
    """What one needs of another is an answer (results) or a role (methods/roles.py)."""
    systems = PACKAGE / "estimators"
    forbidden = []
    for path in (path for path in modules() if path.is_relative_to(systems) and path.parent != systems):
        own = path.relative_to(systems).parts[0]
        for name, line in imports_of(path):
            parts = name.split(".")
            other = parts[2] if parts[:2] == ["groundstation", "estimators"] and len(parts) > 2 else ""
            if (systems / other).is_dir() and other and SYSTEM_OF.get(other, other) != SYSTEM_OF.get(own, own):
                forbidden.append(f"{path}:{line}: {own} imports {name}")
    assert not forbidden


def test_no_file_imports_itself_through_others() -> None:
    """An import circle is one file in several: whoever changes one has to read all of them."""
    files = {_name(path): path for path in modules()}
    graph = {name: _imported(path, files) - {name} for name, path in files.items()}
    left = dict(graph)
    while removable := [name for name, imported in left.items() if not imported & left.keys()]:
        for name in removable:
            del left[name]
    assert not left, f"in or behind an import circle: {', '.join(sorted(left))}"


def test_many_flights_has_at_most_five_floors_and_no_arrow_back() -> None:
    """A file stands one floor above the highest of those in the folder that it imports; so do its parts."""
    files = {_name(path): path for path in modules() if "many_flights" in path.parts}
    graph = {name: _imported(path, files) - {name} for name, path in files.items()}

    @cache
    def floor(name: str) -> int:
        return 1 + max(map(floor, graph[name]), default=0)

    highest = max(graph, key=floor)
    assert floor(highest) <= FLOORS_OF_MANY_FLIGHTS, f"{highest} stands on floor {floor(highest)}"
    part = {name: path.parent.name for name, path in files.items()}
    arrows = {(part[name], part[other]) for name in graph for other in graph[name]}
    left = {one: {other for start, other in arrows if start == one != other} for one in part.values()}
    while removable := [one for one, others in left.items() if not others & left.keys()]:
        for one in removable:
            del left[one]
    assert not left, f"parts that import one another: {', '.join(sorted(left))}"


def _name(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(path: Path, files: Mapping[str, Path]) -> set[str]:
    """Files that a file imports; ``from a import b`` means the file a.b where there is one, else a."""
    found: set[str] = set()
    for node in import_nodes(path):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.update(
                name if (name := f"{node.module}.{alias.name}") in files else node.module or "" for alias in node.names
            )
    return found & files.keys()


def test_picture_of_the_rooms_is_fresh() -> None:
    assert PICTURE.read_text(encoding="utf-8") == picture(), "python -m tests.architecture_picture draws it again"
