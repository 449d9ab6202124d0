"""Data flows one way: the rooms' import table, read off the syntax trees (imports inside functions count)."""

import ast
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest

from groundstation.systems import systems
from tests.architecture_picture import PACKAGE, PICTURE, import_nodes, picture

SHARED = {"base", "tables", "results"}
PAGES = {"base", "results", "plots", "chapters"}
MAY_IMPORT: dict[str, set[str]] = {
    "base": set(),
    "store": {"base"},
    "readers": {"base", "store"},
    "integrity": {"base"},
    "tables": {"base"},
    "results": {"base"},
    "plots": {"base", "results"},
    "chapters": {"base", "results", "plots"},
    "methods": SHARED,
    "simulation": {"base", "tables", "readers"},
    "systems": {*SHARED, "plots", "chapters"},  # the files beside the folders: System, Analysis, Plan, Known
    "viewer": {*SHARED, "plots", "chapters", "systems"},
    "reports": {*SHARED, "plots", "chapters", "systems"},
    "exports": {"base", "readers", "tables", "results"},
    "pipeline": {
        *("base", "readers", "store", "integrity", "tables", "results", "plots", "chapters", "methods", "simulation"),
        *("systems", "viewer", "reports", "exports"),
    },
    "cli": {"base", "results", "chapters", "pipeline"},
}
# What a file of a system may import besides files of its own system, by its role: the end of its name, or its folder.
OF_A_ROLE: dict[str, set[str]] = {
    "settings": {*SHARED, "methods"},
    "answer": {"base", "results"},
    "arrays": {"base", "results"},
    "chapter": PAGES,
    "plots": PAGES,
    "page": PAGES,
    "tab": {*PAGES, "tables", "viewer"},
    "system": {"chapters", "plots", "systems"},
    "study": {*SHARED, "chapters", "methods", "simulation", "systems"},
    "": {*SHARED, "methods", "systems"},
}
OF_PAGES = ("answer", "arrays", "chapter", "plots", "page")  # of a system; they import files of these roles alone
PARTS_OF_THE_PIPELINE = ("one_flight", "many_flights", "verbs", "")  # each imports those before it; "": the Python API
FLOORS_OF_MANY_FLIGHTS = 5
ALLOWED_TO_NAME = {
    "pipeline/answer_methods.py": "the Python API has a method for each answer",
    "pipeline/verbs/acceptance.py": "the verb holds an INS against a standard, by its errors and its heading",
}
# Strings equal to the name of an analysis or of a plan: the word, files or folders (ending in /), what it means there.
ALLOWED_STRINGS: tuple[tuple[str, tuple[str, ...], str], ...] = (
    ("cooperative", ("cli/",), "the verb"),
    ("landing", ("cli/plans.py",), "the verb"),
    ("together", ("systems/loading.py",), "the option --together, which a step of a system serves"),
    ("session", ("cli/", "pipeline/", "reports/", "simulation/"), "recorded flights of several aircraft"),
    (
        "heading",
        ("readers/", "simulation/", "tables/", "methods/taxi/", "results/", "chapters/plots/flight.py"),
        "the angle, beside roll and pitch",
    ),
    ("heading", ("viewer/tabs/raw.py",), "the end of a field's name, as track"),
    ("magnetic", ("readers/", "pipeline/verbs/anonymous.py"), "the north of a direction, as true"),
    ("landing", ("simulation/",), "the leg behind an approach"),
    ("together", ("tables/sources.py", "chapters/provenance.py"), "the key in the metadata of a log joined of several"),
    ("reference", ("methods/fleet/",), "the check of a parking heading, as runway"),
    ("reference", ("pipeline/verbs/compare.py",), "the column that tells rows apart"),
    ("forecast", ("viewer/colours.py",), "the state of a filter without GNSS"),
    ("installation", ("reports/installation.py",), "the mark in the page"),
    (
        "gnss",
        (
            *(
                "base/",
                "chapters/",
                "exports/",
                "integrity/",
                "methods/",
                "pipeline/",
                "plots/",
                "readers/",
                "reports/",
            ),
            *("results/", "simulation/", "store/", "tables/", "viewer/", "systems/joining.py"),
        ),
        "the kind of topic, which every room knows",
    ),
)
FEWEST_LINES = 25
MAY_BE_SHORT = {  # beside __init__.py
    "__main__.py": "python -m groundstation",
    "base/version.py": "read by the build",
    "pipeline/verbs/schema.py": "a command: python -m",
    "readers/bags/marks.py": "every other log is opened without what reads bags",
    "results/file_names.py": "tells results from logs without loading either",
    "results/forecast_methods.py": "words of the forecast for rooms that name no system",
    "store/marks.py": "every other log is opened without the store",
    "systems/gnss/advice_chapter.py": "advice of a system: who looks for it looks there",
    "systems/heading/installation/answer.py": "an answer: who looks for one looks there",
    "systems/latency/arrays.py": "arrays of a system: who looks for them looks there",
    "systems/several_logs/arrays.py": "the same",
}
TESTS = Path(__file__).parent
ONLY_ROOM_OF = {"mcap": "store", "google": "store", "foxglove_schemas_protobuf": "store", "rerun": "viewer"}
NOT_PUBLIC = re.compile(r"/?(rerun_|rerun-[a-z]+-|re_viewer|RERUN_|rerun\.(.*\.)?_)")
NAMES_RERUN = re.compile("rerun|re_viewer|RERUN_")  # a file without it has nothing of NOT_PUBLIC
OF_TUPLES = ("_replace", "_fields", "_asdict", "_make")  # public methods of named tuples, which cannot have others
ONLY_ROOM_OF |= {"AcraNetwork": "tests", "chapter10": "tests"}  # oracles; the first is GPL


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else ""


def system_of(name: str) -> str:
    """Name of the system that a module belongs to; empty for a module of no system."""
    parts = name.split(".")
    is_inside = parts[:2] == ["groundstation", "systems"] and len(parts) > 2
    return parts[2] if is_inside and (PACKAGE / "systems" / parts[2]).is_dir() else ""


def role_of(path: Path) -> str:
    """Role of a file of a system: the end of its name where that is one, ``study`` for all in that folder."""
    end = path.stem.rpartition("_")[2]
    return "study" if "study" in path.parts else end if end in OF_A_ROLE else ""


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
    for path in (path for path in modules() if room_of(path) == room and not system_of(_name(path))):
        for name, line in imports_of(path):
            top, _, rest = name.partition(".")
            other = rest.partition(".")[0]
            is_foreign = top == "groundstation" and room and other and not other.startswith("__") and other != room
            if is_foreign and other not in MAY_IMPORT[room] and not system_of(name):
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
        text = path.read_text(encoding="utf-8")
        if room_of(path) != "viewer" and not NAMES_RERUN.search(text):
            continue
        tree = ast.parse(text)
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


def _role_of_module(name: str) -> str:
    return role_of(PACKAGE.parent / Path(*name.split(".")).with_suffix(".py"))


def test_file_of_a_system_imports_only_what_its_role_may() -> None:
    forbidden = []
    for path in (path for path in modules() if system_of(_name(path))):
        role = role_of(path)
        for name, line in imports_of(path):
            top, _, rest = name.partition(".")
            other = rest.partition(".")[0]
            if top == "groundstation" and not system_of(name) and other not in OF_A_ROLE[role]:
                forbidden.append(f"{path}:{line}: {role or 'method'} imports {name}")
            if system_of(name) == system_of(_name(path)) and role in OF_PAGES and _role_of_module(name) not in OF_PAGES:
                forbidden.append(f"{path}:{line}: {role} imports {name}")
            if top in ONLY_ROOM_OF and not (role == "tab" and ONLY_ROOM_OF[top] == "viewer"):
                forbidden.append(f"{path}:{line}: {role or 'method'} imports {top}")
    assert not forbidden


def test_a_system_is_named_by_no_file_outside_its_folder() -> None:
    """What one needs of another is a role; rooms loop over the systems."""
    named: dict[str, list[str]] = {}
    for path in modules():
        for name, line in imports_of(path):
            if system_of(name) not in ("", system_of(_name(path))):
                named.setdefault(str(path.relative_to(PACKAGE)), []).append(f"{path}:{line}: {name}")
    assert not [line for path, lines in named.items() if path not in ALLOWED_TO_NAME for line in lines]
    assert ALLOWED_TO_NAME.keys() <= named.keys(), "no longer names a system: take it off ALLOWED_TO_NAME"


def test_an_analysis_is_named_by_no_string_outside_its_folder() -> None:
    """Rooms loop over the systems. A word that means another thing, and a verb, is listed with what it means."""
    names = {*systems().answer_types, *(plan.name for plan in systems().plans)}
    new, met = [], set()
    quoted = re.compile("|".join(f"[\"']{name}[\"']" for name in names))
    for path in (path for path in modules() if not system_of(_name(path))):
        text = path.read_text(encoding="utf-8")
        if not quoted.search(text):
            continue
        tree = ast.parse(text)
        docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        place = path.relative_to(PACKAGE).as_posix()
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and node.value in names and id(node) not in docstrings:
                rows = [row for row in ALLOWED_STRINGS if row[0] == node.value and _is_at(place, row[1])]
                met.update(rows)
                new += [] if rows else [f"{path}:{node.lineno}: {node.value!r}"]
    assert not new
    assert not set(ALLOWED_STRINGS) - met, "no longer there: take it off ALLOWED_STRINGS"


def _is_at(place: str, files: tuple[str, ...]) -> bool:
    return any(place == one or (one.endswith("/") and place.startswith(one)) for one in files)


def test_tests_of_a_system_import_no_tests_of_another() -> None:
    """What tests of several systems use stands beside their folders."""
    forbidden = []
    for path in sorted((TESTS / "systems").rglob("*.py")):
        system = path.relative_to(TESTS / "systems").parts[0]
        assert (PACKAGE / "systems" / system).is_dir(), f"{path}: no system of that name"
        for name, line in imports_of(path):
            parts = [*name.split("."), "", ""]
            if parts[:2] == ["tests", "systems"] and parts[2] != system:
                forbidden.append(f"{path}:{line}: {name}")
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


def test_a_short_file_is_one_of_those_listed() -> None:
    """One of a few lines belongs to a neighbour, unless it has a reason to stand alone."""
    short = {
        path.relative_to(PACKAGE).as_posix()
        for path in modules()
        if path.name != "__init__.py" and len(path.read_text(encoding="utf-8").splitlines()) < FEWEST_LINES
    }
    new = ", ".join(sorted(short - MAY_BE_SHORT.keys()))
    assert not new, f"fewer than {FEWEST_LINES} lines: {new}: merge it with the file that needs it"
    assert not MAY_BE_SHORT.keys() - short, "no longer short: take it off MAY_BE_SHORT"


def test_picture_of_the_rooms_is_fresh() -> None:
    assert PICTURE.read_text(encoding="utf-8") == picture(), "python -m tests.architecture_picture draws it again"
