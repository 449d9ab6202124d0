"""Entry points of others are found wherever ``importlib.metadata`` finds them, which is asked only where there may be.

Each case is seen by a new process: what is installed is looked through once.
"""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

OTHERS = "[groundstation.readers]\nother = other.reader\n"
OURS = "[console_scripts]\na = b:c\n\n[groundstation.readers]\nflat_csv = groundstation.readers.flat_csv\n"
ASK = """
import sys
{before}
from importlib.metadata import entry_points
from groundstation.base import plug_ins
found = {{one.name for one in plug_ins.entry_points_of("groundstation.readers")}} - {{"flat_csv"}}
truth = {{one.name for one in entry_points(group="groundstation.readers")}} - {{"flat_csv"}}
assert found == truth, (found, truth)
print(plug_ins._may_have_plug_ins(), *found)
"""
FINDER = """
from importlib.metadata import Distribution
class Own(Distribution):
    def read_text(self, name): return {"METADATA": "Name: other", "entry_points.txt": TEXT}.get(name)
    def locate_file(self, path): return path
class Finder:
    def find_spec(self, *_): return None
    def find_distributions(self, _context): return [Own()]
sys.meta_path.append(Finder())
"""


def installed(folder: Path, name: str, text: str | bytes) -> Path:
    """Make a folder of packages with one that has these entry points."""
    about = folder / name
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1.0\n")
    (about / "entry_points.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


def answer(*paths: Path, before: str = "") -> list[str]:
    """Return whether there may be plug-ins, and the names of those there are."""
    root = Path(__file__).parents[1]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (*paths, root)))}
    command = [sys.executable, "-c", ASK.format(before=before)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_our_own_entry_points_ask_nobody(tmp_path: Path) -> None:
    assert answer(installed(tmp_path, "other-1.0.dist-info", OURS)) == ["False"]


@pytest.mark.parametrize("name", ["other-1.0.dist-info", "other.egg-info", "Other-1.0.DIST-INFO"])
def test_those_of_others_are_found(name: str, tmp_path: Path) -> None:
    spellings = (OTHERS, OURS + "\n" + OTHERS, OTHERS.replace("\n", "\r\n"), OTHERS.replace(" = ", "="))
    for number, spelling in enumerate(spellings):
        folder = installed(tmp_path / str(number), name, spelling)
        assert answer(folder) == ["True", "other"]


def test_one_that_is_hidden_by_another_of_its_name_is_not_used(tmp_path: Path) -> None:
    first = installed(tmp_path / "first", "other-2.0.dist-info", OURS)
    second = installed(tmp_path / "second", "other-1.0.dist-info", OTHERS)
    assert answer(first, second) == ["True"]
    assert answer(second, first) == ["True", "other"]


def test_an_egg_and_a_zip_are_looked_into(tmp_path: Path) -> None:
    egg = installed(tmp_path / "other-1.0.egg", "EGG-INFO", OTHERS)
    assert answer(egg) == ["True", "other"]
    with zipfile.ZipFile(tmp_path / "packages.zip", "w") as packed:
        packed.writestr("other-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: other\nVersion: 1.0\n")
        packed.writestr("other-1.0.dist-info/entry_points.txt", OTHERS)
    assert answer(tmp_path / "packages.zip") == ["True", "other"]


def test_a_finder_of_somebody_is_asked(tmp_path: Path) -> None:
    assert answer(before=f"TEXT = {OTHERS!r}{FINDER}") == ["True", "other"]


def test_folders_that_are_absent_or_no_packages_are_passed_over(tmp_path: Path) -> None:
    (tmp_path / "legacy.egg-info").write_text("Metadata-Version: 1.0\nName: legacy\n")
    assert answer(tmp_path, tmp_path / "absent") == ["False"]
