"""A system can be taken out: without its folder and its line everything else runs."""

import re
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from groundstation.systems import OURS, systems
from tests.test_extending import ROOT, groundstation

SAMPLE = ROOT / "sample_logs" / "taxi-short.csv"
NAMES = tuple(path.split(".")[2] for path in OURS)
# Systems that files of tests/references/systems_named.txt still import: the rows of a fleet, the steer card, exports.
NOT_YET: tuple[str, ...] = ()
FREE = tuple(one for one in NAMES if one not in NOT_YET)
TODAY = FREE[datetime.now(UTC).toordinal() % len(FREE)]  # one by turns; all by the slow mark


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


def _marks(name: str) -> list[pytest.MarkDecorator]:
    named = [pytest.mark.xfail(strict=True, reason="files outside still import it")] if name in NOT_YET else []
    return named if name == TODAY else [*named, pytest.mark.slow]


@pytest.mark.parametrize("name", [pytest.param(one, marks=_marks(one)) for one in NAMES])
def test_everything_else_runs_without_a_system(name: str, tmp_path: Path) -> None:
    gone = taken_out(tmp_path, name)
    listed = groundstation(tmp_path, "list")
    assert listed.returncode == 0, listed.stderr
    done = groundstation(tmp_path, "run", str(SAMPLE), "-o", "out", "-j", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    again = groundstation(tmp_path, "report", "out")
    assert again.returncode == 0, again.stdout + again.stderr
    (summary,) = (tmp_path / "out").glob("*/summary.json")
    results = summary.read_text(encoding="utf-8")
    assert '"internal.' not in results
    for one in systems().every:
        if one.name in gone:
            assert not any(f'"{analysis.name}": {{' in results for analysis in one.analyses)
