"""A field of an answer, or a column of its arrays, renamed where it is made stops the type check where it is read.

Every answer is a type to its last reader; a mapping between the two would let the old name pass, and the page would
show a dash.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import groundstation

PACKAGE = Path(groundstation.__file__).parent
# What makes the answers, and some of what reads them: a whole package would take mypy a minute.
CHECKED = (
    *("systems/heading/answer.py", "systems/inertial/answer.py", "base/ledger.py", "integrity/ledger.py"),
    *("systems/heading/outcome.py", "systems/inertial/estimate.py"),
    *("systems/heading/chapter.py", "systems/inertial/chapter.py", "cli/check_table.py"),
    *("systems/heading/arrays.py", "systems/heading/figures.py"),
    *("systems/heading/plots.py", "systems/heading/tab.py", "systems/heading/comparison_plots.py"),
)
ARRAYS = ("systems/heading/arrays.py", "systems/heading/figures.py")
# Field, and the files that define and make it; those that read it keep the old name.
RENAMED = (
    ("estimate_sd_deg", ("systems/heading/answer.py", "systems/heading/outcome.py"), "systems/heading/chapter.py"),
    (
        "radial_error_rate_50_nmiph",
        ("systems/inertial/answer.py", "systems/inertial/estimate.py"),
        "systems/inertial/chapter.py",
    ),
    ("honest_half_width_deg", ARRAYS, "systems/heading/plots.py"),
    ("honest_half_width_deg", ARRAYS, "systems/heading/comparison_plots.py"),
    ("longest_s", ("base/ledger.py", "integrity/ledger.py"), "cli/check_table.py"),
)


def checked(folder: Path) -> "subprocess.CompletedProcess[str]":
    """The package in a folder as mypy sees it; what a first run found out serves the next."""
    options = ("--strict", "--cache-dir", ".cache", "--follow-imports", "silent", "--ignore-missing-imports")
    files = [str(Path("groundstation", name)) for name in CHECKED]
    command = [sys.executable, "-m", "mypy", *options, *files]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def written(path: Path, text: str) -> None:
    """Write a file; its time is a second after the last, for mypy takes equal size and second for an equal file."""
    second = int(path.stat().st_mtime) + 1
    path.write_text(text, encoding="utf-8")
    os.utime(path, (second, second))


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("copy")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PACKAGE, folder / "groundstation", ignore=ignored)
    found = checked(folder)
    assert found.returncode == 0, found.stdout
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(("field", "made", "read"), RENAMED, ids=[f"{field} of {read}" for field, _, read in RENAMED])
def test_a_renamed_field_is_missed_by_who_reads_it(field: str, made: tuple[str, ...], read: str, copied: Path) -> None:
    files = [copied / "groundstation" / name for name in made]
    before = [path.read_text(encoding="utf-8") for path in files]
    try:
        for path, text in zip(files, before, strict=True):
            renamed = re.sub(rf"\b{field}\b(?=[:=])", f"new_{field}", text)
            assert renamed != text, f"{path.name} has no {field}"
            written(path, renamed)
        found = checked(copied)
    finally:
        for path, text in zip(files, before, strict=True):
            written(path, text)
    assert found.returncode == 1, found.stdout
    assert not any(f"groundstation/{name}:" in found.stdout for name in made), "the answer is not made as it is defined"
    told = rf'^groundstation/{read}:\d+: error: .* has no attribute "{field}"'
    assert re.search(told, found.stdout, re.MULTILINE), found.stdout
