"""The recipe of docs/extending.md, carried out in a copy of the package: one folder and one line are enough."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.recording_contents import Contents

ROOT = Path(__file__).parents[1]
RECIPE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
FILE_BLOCKS = re.compile(r"^`(groundstation/[\w/]+\.py)`\n\n```(python|diff)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LONGEST_S = 300


@dataclass(frozen=True)
class Scratch:
    """A copy of the package with the recipe carried out, and a run of a sample log with it."""

    folder: Path
    flight: Path
    told: str

    def groundstation(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        return groundstation(self.folder, *arguments)


def groundstation(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command of the package that lies in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "groundstation", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "numba")},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=LONGEST_S,
        check=False,
    )


def carry_out(folder: Path) -> None:
    """Write the files of the recipe into a copy of the package, and change those that it changes."""
    for name, kind, text in FILE_BLOCKS.findall(RECIPE):
        path = folder / name
        if kind == "diff":
            path.write_text(patched(path.read_text(encoding="utf-8"), text), encoding="utf-8")
            continue
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
        (path.parent / "__init__.py").write_text('"""An analysis of the recipe."""\n', encoding="utf-8")


def patched(module: str, difference: str) -> str:
    """A module with an import added and a line replaced, as a block of the recipe says."""
    signs = [(line[0], line[1:]) for line in difference.splitlines()]
    (imported, *_), added = ([text for sign, text in signs if sign == "+"], signs[-1][1])
    (removed,) = (text for sign, text in signs if sign == "-")
    assert module.count(f"\n{removed}\n") == 1, f"not a line of the module: {removed}"
    first = module.index("\nfrom groundstation.")
    return f"{module[:first]}\n{imported}{module[first:]}".replace(f"\n{removed}\n", f"\n{added}\n")


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Scratch:
    folder = tmp_path_factory.mktemp("scratch")
    shutil.copytree(ROOT / "groundstation", folder / "groundstation", ignore=shutil.ignore_patterns("__pycache__"))
    carry_out(folder)
    (settings,) = re.findall(r"^```toml\n(.*?)^```$", RECIPE, re.MULTILINE | re.DOTALL)
    (folder / "c.toml").write_text(settings, encoding="utf-8")
    log = ROOT / "sample_logs" / "taxi-good.csv"
    run = groundstation(folder, "run", str(log), "-o", "out", "--no-pdf", "-j", "1", "--config", "c.toml")
    assert run.returncode == 0, run.stderr
    (summary,) = (folder / "out").glob("*/summary.json")
    return Scratch(folder, summary.parent, run.stdout + run.stderr)


def answer_of(scratch: Scratch) -> dict[str, object]:
    document = json.loads((scratch.flight / "summary.json").read_text(encoding="utf-8"))
    answer = document["results"]["gnss_noise"]
    assert isinstance(answer, dict)
    return answer


def test_the_answer_is_saved_with_the_settings_that_were_set(scratch: Scratch) -> None:
    answer = answer_of(scratch)
    assert 0.01 < float(str(answer["speed_rms_mps"])) < 0.2
    assert answer["settings"] == {"standstill_min_s": 20.0, "guard_s": 1.0}
    assert answer["standstills"]
    assert (scratch.flight / "results.parquet" / "gnss_noise_speed.parquet").exists()
    findings = json.loads((scratch.flight / "summary.json").read_text(encoding="utf-8"))["findings"]
    assert [one["severity"] for one in findings if one["code"] == "gnss_noise.found"] == ["info"]


def test_the_outcome_tells_it_in_its_line(scratch: Scratch) -> None:
    assert f"GNSS shows {float(str(answer_of(scratch)['speed_rms_mps'])):.3f} m/s RMS at standstill" in scratch.told


def test_a_key_that_does_not_exist_is_refused(scratch: Scratch) -> None:
    (scratch.folder / "wrong.toml").write_text("[gnss_noise]\nstandstil_min_s = 20\n", encoding="utf-8")
    log = ROOT / "sample_logs" / "taxi-good.csv"
    refused = scratch.groundstation("run", str(log), "-o", "other", "--config", "wrong.toml")
    assert refused.returncode == 2
    assert "gnss_noise.standstil_min_s" in refused.stderr
    assert not (scratch.folder / "other").exists()


def test_list_names_it(scratch: Scratch) -> None:
    listed = json.loads(scratch.groundstation("list", "--json").stdout)
    (entry,) = (entry for entry in listed if entry["name"] == "gnss_noise")
    assert entry["needs"] == "gnss velocities, and a standstill"


def test_the_report_has_its_chapter_and_has_it_again(scratch: Scratch) -> None:
    page = scratch.flight / "report.html"
    first = page.read_text(encoding="utf-8")
    for shown in ('id="gnss_noise"', "GNSS noise", "Speed RMS", "Standstills", "tables/gnss_noise_speed.csv"):
        assert shown in first, shown
    again = scratch.groundstation("report", str(scratch.flight), "--no-pdf")
    assert again.returncode == 0, again.stderr
    assert page.read_text(encoding="utf-8") == first


def test_the_recording_has_its_tab(scratch: Scratch) -> None:
    contents = Contents(scratch.flight / f"{scratch.flight.name}.rrd")
    text = contents.text("/gnss_noise/answer")
    assert text.startswith("# GNSS noise\n")
    assert "Standstills" in text
    values = contents.scalars("/gnss_noise/gnss_noise_speed/m_s")[1]
    rms = float(np.sqrt(np.nanmean(values**2)))
    assert rms == pytest.approx(float(str(answer_of(scratch)["speed_rms_mps"])), abs=0.05)
