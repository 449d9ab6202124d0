"""A system can be taken out: without its folder and its line all else runs, type-checks and passes its tests."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Collection
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import pytest

from groundstation.systems import OURS, systems
from tests.architecture_picture import import_nodes
from tests.test_architecture import ALLOWED_TO_NAME
from tests.test_extending import LONGEST_S, ROOT, groundstation

SAMPLE = ROOT / "sample_logs" / "taxi-short.csv"
NAMES = tuple(path.split(".")[2] for path in OURS)
TODAY = NAMES[datetime.now(UTC).toordinal() % len(NAMES)]  # one by turns; all by the slow mark
SOME_TESTS = (  # of each system, quick ones that need no other system
    "heading/test_parts.py",
    "inertial/test_filter.py",
    "latency/test_coverage.py",
    "magnetic/test_ground.py",
    "landing/test_beacons.py",
    "reference/test_beside.py",
    "cooperative/test_filters.py",
    "planning/test_plan.py",
)
OVERRIDE = '\n[[tool.mypy.overrides]]\nmodule = [{}]\nfollow_imports = "error"\n'


def taken_out(folder: Path, name: str) -> list[str]:
    """Copy the package without a system and those that require it; their names."""
    left_out = shutil.ignore_patterns("*.pyc.*", "*.tmp.*")
    shutil.copytree(ROOT / "groundstation", folder / "groundstation", ignore=left_out)
    gone = [name, *_requiring(name)]
    listed = folder / "groundstation" / "systems" / "__init__.py"
    text = listed.read_text(encoding="utf-8")
    for one in gone:
        shutil.rmtree(folder / "groundstation" / "systems" / one)
        text, count = re.subn(rf'    "groundstation\.systems\.{one}\.system",\n', "", text)
        assert count == 1
    listed.write_text(text, encoding="utf-8")
    return gone


def _requiring(name: str) -> list[str]:
    """Names of the systems with an analysis that cannot run without one of a system."""
    system = next(one for one in systems().every if one.name == name)
    own = {one.name for one in (*system.analyses, *system.session_analyses)}
    others = (one for one in systems().every if one is not system)
    return [one.name for one in others if any(own & set(analysis.requires) for analysis in one.analyses)]


def _python(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python in a folder whose package comes before the one installed."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=2 * LONGEST_S,
        check=False,
    )


EVERY = pytest.mark.parametrize("name", NAMES)
BY_TURNS = pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[] if one == TODAY else [pytest.mark.slow]) for one in NAMES]
)


@pytest.mark.slow
@BY_TURNS
def test_everything_else_runs_without_a_system(name: str, tmp_path: Path) -> None:
    gone = taken_out(tmp_path, name)
    listed = groundstation(tmp_path, "list")
    assert listed.returncode == 0, listed.stderr
    done = groundstation(tmp_path, "run", str(SAMPLE), "-o", "out", "-j", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    again = groundstation(tmp_path, "report", "out")
    assert again.returncode == 0, again.stdout + again.stderr
    (summary,) = (tmp_path / "out").glob("*/summary.json")
    text = summary.read_text(encoding="utf-8")
    assert '"internal.' not in text
    taken = {analysis.name for one in systems().every if one.name in gone for analysis in one.analyses}
    assert not taken & json.loads(text)["results"].keys()


@pytest.mark.slow
@EVERY
def test_types_hold_without_a_system(name: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Files that may name a system are not asked; the cache serves one system after another."""
    gone = taken_out(tmp_path, name)
    modules = ", ".join(f'"groundstation.systems.{one}", "groundstation.systems.{one}.*"' for one in gone)
    settings = (ROOT / "pyproject.toml").read_text(encoding="utf-8") + OVERRIDE.format(modules)
    (tmp_path / "pyproject.toml").write_text(settings, encoding="utf-8")
    cache = tmp_path_factory.getbasetemp() / "types"
    checked = _python(tmp_path, "-m", "mypy", "--cache-dir", str(cache), "groundstation")
    assert "source files" in checked.stdout, checked.stdout + checked.stderr
    errors = [line for line in checked.stdout.splitlines() if ": error: " in line]
    allowed = tuple(f"groundstation/{path}:" for path in ALLOWED_TO_NAME)
    left = [line for line in errors if not line.replace("\\", "/").startswith(allowed)]
    assert not left, "\n".join(left)


@pytest.mark.slow
@EVERY
def test_others_pass_their_tests_without_a_system(name: str, tmp_path: Path) -> None:
    gone = taken_out(tmp_path, name)
    for folder in ("tests", "docs", "schemas", "sample_logs"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__", *gone))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    some = [f"tests/systems/{path}" for path in SOME_TESTS if path.partition("/")[0] not in gone]
    tested = _python(tmp_path, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *some)
    assert tested.returncode == 0, tested.stdout[-4000:]


@cache
def named_by(path: Path) -> frozenset[str]:
    """Systems that a file of the tests names by its imports, by itself and through other files of the tests."""
    named: set[str] = set()
    left, seen = [path], {path}
    while left:
        for node in import_nodes(left.pop()):
            modules = [alias.name for alias in node.names]
            if isinstance(node, ast.ImportFrom):
                modules = [node.module or "", *(f"{node.module}.{one}" for one in modules)]
            for module in modules:
                parts = module.split(".")
                if parts[:2] == ["groundstation", "systems"] and len(parts) > 2:
                    named.add(parts[2])
                imported = ROOT / Path(*parts).with_suffix(".py")
                if parts[0] == "tests" and imported.is_file() and imported not in seen:
                    seen.add(imported)
                    left.append(imported)
    return frozenset(named)


def remaining(gone: Collection[str]) -> list[str]:
    """Files of the systems' tests that stay when some systems go."""
    staying = [one for one in NAMES if one not in gone]
    files = [path for one in staying for path in sorted((ROOT / "tests" / "systems" / one).glob("test_*.py"))]
    return [path.relative_to(ROOT).as_posix() for path in files if not named_by(path) & set(gone)]


@pytest.mark.parametrize("name", NAMES)
def test_most_tests_of_the_others_stand_without_a_system(name: str) -> None:
    """Every system that stays keeps tests which do not know the one that went."""
    gone = [name, *_requiring(name)]
    left = {path.split("/")[2] for path in remaining(gone)}
    assert left == set(NAMES) - set(gone)
