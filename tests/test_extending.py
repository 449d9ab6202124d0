"""The recipes of docs/extending.md, carried out in copies of the package: what they name is enough."""

import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.recording_contents import Contents

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
RECIPES = dict(
    re.findall(r"^## ((?:A system|A tab|A signal|A reader))\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
)
FILE_BLOCKS = re.compile(r"^`([\w/]+\.(?:py|proto))`\n\n```(python|diff|proto)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE_LINK = re.compile(r"^\[`([\w/]+\.py)`\]\((examples/[\w/.]+)\)$", re.MULTILINE)
TOML_BLOCK = re.compile(r"^```toml\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LONGEST_S = 300


@dataclass(frozen=True)
class Scratch:
    """A copy of the package with the recipe carried out, and a run of a sample log with it."""

    folder: Path
    flight: Path
    told: str

    def groundstation(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        return groundstation(self.folder, *arguments)

    def python(self, program: str) -> str:
        """What a program prints that imports the copy."""
        command = [sys.executable, "-c", program]
        run = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False, timeout=LONGEST_S)
        assert run.returncode == 0, run.stderr
        return run.stdout


def groundstation(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command of the package that lies in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "groundstation", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=LONGEST_S,
        check=False,
    )


def carry_out(recipe: str, folder: Path) -> None:
    """Write the files of a recipe into a copy of the package, and change those that it changes."""
    blocks = FILE_BLOCKS.findall(RECIPES[recipe])
    for name, link in FILE_LINK.findall(RECIPES[recipe]):
        blocks.append((name, "python", (ROOT / "docs" / link).read_text(encoding="utf-8")))
    assert blocks, recipe
    for name, kind, text in blocks:
        path = folder / name
        if kind == "diff":
            path.write_text(patched(path.read_text(encoding="utf-8"), text), encoding="utf-8")
            continue
        if not path.parent.exists():
            path.parent.mkdir()
            (path.parent / "__init__.py").write_text('"""An analysis of the recipe."""\n', encoding="utf-8")
        path.write_text(text, encoding="utf-8")


def patched(module: str, difference: str) -> str:
    """A module with imports added and lines replaced, as a block of a recipe says."""
    signs = [(line[0], line[1:]) for line in difference.splitlines()]
    place = next(at for at, (sign, _) in enumerate(signs) if sign == "-")
    imported = "".join(f"{text}\n" for _, text in signs[:place])
    (removed,), added = ([text for sign, text in signs if sign == "-"], [text for _, text in signs[place + 1 :]])
    assert module.count(f"\n{removed}\n") == 1, f"not a line of the module: {removed}"
    if imported:
        first = module.index("\nfrom groundstation.") + 1
        module = f"{module[:first]}{imported}{module[first:]}"
    return module.replace(f"\n{removed}\n", "\n{}\n".format("\n".join(added)))


def copy_of_the_package(folder: Path) -> None:
    """With what is compiled already, but nothing that another process may be writing just now."""
    for part in ("groundstation", "schemas"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("*.pyc.*", "*.tmp.*"))


def installed(folder: Path, package: str, entry_points: str) -> None:
    """Let a package in a folder be found as if it were installed, with its entry points."""
    ((group, points),) = tomllib.loads(entry_points)["project"]["entry-points"].items()
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", encoding="utf-8")
    lines = [f"[{group}]", *(f"{name} = {module}" for name, module in points.items())]
    (about / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")


def rotor(folder: Path) -> None:
    """Carry out the recipes of the signal and the reader in a copy of the package, and write three logs."""
    carry_out("A signal", folder)
    carry_out("A reader", folder)
    schemas = [str(path.relative_to(folder)) for path in sorted((folder / "schemas").glob("*.proto"))]
    command = [sys.executable, "-m", "grpc_tools.protoc", "-Ischemas", "--include_imports"]
    out = "--descriptor_set_out=groundstation/store/descriptors.binpb"
    subprocess.run([*command, out, *schemas], cwd=folder, check=True, capture_output=True)
    (entry_points,) = TOML_BLOCK.findall(RECIPES["A reader"])
    installed(folder, "rotor_log", entry_points)
    records = b"".join(struct.pack("<If", 100 * at, 300.0 + at % 3) for at in range(200))
    (folder / "whole.rotor").write_bytes(b"ROTORLOG" + records)
    (folder / "cut.rotor").write_bytes(b"ROTORLOG" + records[:-3])
    rows = "".join(f"{0.1 * at:.1f},{5.0 if at != 7 else 500.0}\n" for at in range(200))
    (folder / "rotor.csv").write_text("time_s,rotor.speed_hz\n" + rows, encoding="utf-8")


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Scratch:
    folder = tmp_path_factory.mktemp("scratch")
    copy_of_the_package(folder)
    carry_out("A system", folder)
    rotor(folder)
    entry_points, settings = TOML_BLOCK.findall(RECIPES["A system"])
    installed(folder, "gnss_noise", entry_points)
    (folder / "c.toml").write_text(settings, encoding="utf-8")
    log = ROOT / "sample_logs" / "taxi-good.csv"
    run = groundstation(folder, "run", str(log), "-o", "out", "--no-pdf", "-j", "1", "--config", "c.toml", "-v")
    assert run.returncode == 0, run.stderr
    (summary,) = (folder / "out").glob("*/summary.json")
    return Scratch(folder, summary.parent, run.stdout + run.stderr)


def answer_of(scratch: Scratch) -> dict[str, object]:
    document = json.loads((scratch.flight / "summary.json").read_text(encoding="utf-8"))
    answer = document["results"]["gnss_noise"]
    assert isinstance(answer, dict)
    return answer


def test_its_columns_stand_in_the_tables_of_flights(scratch: Scratch) -> None:
    answer = answer_of(scratch)
    (row,) = json.loads((scratch.folder / "out" / "index.json").read_text(encoding="utf-8"))["rows"]
    assert row["gnss_noise_speed_rms_mps"] == answer["speed_rms_mps"]
    names = list(row)
    place = names.index("gnss_noise_start_s")
    assert names[place + 1] == "gnss_noise_speed_rms_mps" and place < names.index("findings_fail")
    table = pq.read_table(scratch.folder / "out" / "fleet.parquet")
    assert table["gnss_noise_start_s"].to_pylist() == [answer["start_s"]]
    assert json.loads(table.schema.metadata[b"columns"])["gnss_noise_speed_rms_mps"] == "speed shown in it"


def test_the_answer_is_saved_with_the_settings_that_were_set(scratch: Scratch) -> None:
    answer = answer_of(scratch)
    assert 0.01 < float(str(answer["speed_rms_mps"])) < 0.2
    assert answer["settings"] == {"standstill_min_s": 20.0, "guard_s": 1.0}
    assert answer["standstills"]
    assert (scratch.flight / "arrays" / "gnss_noise_speed.parquet").exists()
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
    values = contents.scalars("/generic/series/gnss_noise_speed/speed/b00_lines")[1]
    rms = float(np.sqrt(np.nanmean(values**2)))
    assert rms == pytest.approx(float(str(answer_of(scratch)["speed_rms_mps"])), abs=0.05)


def told(folder: Path, log: str, code: int) -> dict[str, Any]:
    """What ``check --json`` says of the topic ``rotor``."""
    checked = groundstation(folder, "check", log, "--json")
    assert checked.returncode == code, checked.stderr
    (one,) = json.loads(checked.stdout)
    topic = one["ledger"]["topics"]["rotor"]
    assert isinstance(topic, dict)
    return topic


def test_a_signal_is_read_from_a_table_and_its_range_is_checked(scratch: Scratch) -> None:
    topic = told(scratch.folder, "rotor.csv", 0)
    assert topic["rows"] == 200
    assert topic["fields"]["speed_hz"]["out_of_range"] == 1


def test_a_reader_is_found_by_the_content_and_what_is_cut_is_counted(scratch: Scratch) -> None:
    whole, cut = told(scratch.folder, "whole.rotor", 0), told(scratch.folder, "cut.rotor", 3)
    assert (whole["rows"], cut["rows"]) == (200, 199)
    assert "rotor-log" in groundstation(scratch.folder, "list").stdout


def test_records_of_a_reader_are_those_of_the_log(scratch: Scratch) -> None:
    converted = groundstation(scratch.folder, "convert", "whole.rotor", "-o", "whole.mcap")
    assert converted.returncode == 0, converted.stderr
    program = "import groundstation as g; t = g.open('whole.mcap').tables['rotor']; print(*t.values('speed_hz')[:3])"
    assert scratch.python(program).split() == [str(300.0 / 60.0), str(301.0 / 60.0), str(302.0 / 60.0)]


def test_a_tab_of_its_own_takes_the_place_of_the_generic_one(scratch: Scratch) -> None:
    generic = Contents(next(scratch.flight.glob("*.rrd"))).text("/gnss_noise/answer")
    carry_out("A tab", scratch.folder)  # the last test: the copy has another tab from here on
    scratch.python(f"import groundstation;groundstation.open({str(scratch.flight)!r}).recording('own.rrd')")
    contents = Contents(scratch.folder / "own.rrd")
    assert contents.text("/gnss_noise/answer") == generic
    speed_mps = contents.scalars("/gnss_noise/speed")[1]
    assert speed_mps.size and np.isfinite(speed_mps).all()
