"""fleet.parquet and samples.parquet: typed, complete, incremental, the same bytes whatever the order."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tracemalloc
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.methods.fleet.moments import merged, moments_of
from groundstation.pipeline.many_flights.fleet import refresh as fleet_refresh
from groundstation.pipeline.many_flights.fleet import rows as fleet_rows
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS, FlightShare
from groundstation.pipeline.many_flights.fleet.publishing import write_beside
from groundstation.pipeline.many_flights.fleet.refresh import EarlyShares, refresh
from groundstation.pipeline.many_flights.fleet.rows import share_of
from groundstation.pipeline.many_flights.fleet.samples import MEANINGS, SAMPLES, SampleStore, partition
from groundstation.pipeline.many_flights.fleet.scan import FLIGHTS
from groundstation.pipeline.many_flights.fleet.statistics import FLEET_PARQUET, gather, write_fleet
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.fleet import FleetResults
from groundstation.systems.heading.answer import OnboardComparison, RunwayCheck
from groundstation.systems.inertial.columns import FORECAST_COLUMNS
from tests.fleet_example import START_NS, save_flight, skill

REPOSITORY = Path(__file__).parents[1]
DOCS = REPOSITORY / "docs" / "fleet.md"
HOSTILE = "Як-130 №7/../=1+1%41 \udcff"


def write(out: Path) -> FleetResults:
    found, unwritten = refresh(out)
    results, problems = write_fleet(out, found)
    assert unwritten == problems == ()
    return results


def sample_files(out: Path) -> dict[str, Path]:
    return {path.stem: path for path in sorted((out / SAMPLES).rglob("*.parquet"))}


def contents(out: Path) -> dict[str, bytes]:
    files = [out / FLEET_PARQUET, *(out / FLIGHTS).rglob("*"), *(out / SAMPLES).rglob("*")]
    return {str(path.relative_to(out)): path.read_bytes() for path in files if path.is_file()}


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve flights of two aircraft over two months and one without an aircraft."""
    out = tmp_path_factory.mktemp("fleet")
    for number in range(12):
        aircraft = "A12" if number % 2 else "101"
        save_flight(out, 4 * number, aircraft=aircraft, error_deg=0.1 * number, forecast=skill(rms_m=100.0 + number))
    save_flight(out, 50, aircraft="", error_deg=-2.0, samples=30)
    write(out)
    return out


def test_the_forecast_stands_beside_the_raw_ins() -> None:
    made = skill(rms_m=100.0)
    rows = tuple(replace(one, p95_m=900.0 if one.method == "raw_ins" else one.p95_m) for one in made.skill)
    told = {column.name: column.value(replace(made, skill=rows)) for column in FORECAST_COLUMNS}
    assert told["forecast_60min_p95_m"] == 200.0 and told["raw_60min_p95_m"] == 900.0
    assert {column.name: column.value(replace(made, skill=())) for column in FORECAST_COLUMNS}[
        "raw_60min_p95_m"
    ] is None


def test_flights_are_typed_with_units_and_meanings(fleet: Path) -> None:
    found = pq.read_table(fleet / FLEET_PARQUET)
    kinds = {
        "text": pa.string(),
        "category": pa.dictionary(pa.int32(), pa.string()),
        "number": pa.float64(),
        "count": pa.int64(),
        "time": pa.timestamp("ns", tz="UTC"),
        "flag": pa.bool_(),
    }
    assert found.column_names == [column.name for column in FLIGHT_COLUMNS]
    assert {column.name: found.schema.field(column.name).type for column in FLIGHT_COLUMNS} == {
        column.name: kinds[column.kind] for column in FLIGHT_COLUMNS
    }
    meanings = json.loads(found.schema.metadata[b"columns"])
    assert list(meanings) == found.column_names and all(meanings.values())
    row = found.slice(1, 1).to_pylist()[0]
    assert row["aircraft"] == "A12" and row["month"] == "2026-05" and row["error_deg"] == 0.1
    assert row["start_utc"].isoformat() == "2026-05-08T06:00:00+00:00"
    assert row["samples"] == 360 and row["has_lost_data"] is False and row["forecast_60min_rms_m"] == 202.0
    assert row["forecast_60min_p95_m"] == row["raw_60min_p95_m"] == 202.0, "of both methods in the example"
    last = found.slice(12, 1).to_pylist()[0]
    assert last["aircraft"] is None and last["onboard_error_deg"] is None and last["forecast_method"] is None


def test_samples_are_those_of_the_flight(fleet: Path) -> None:
    name, path = next(iter(sample_files(fleet).items()))
    assert path.parent.name == "month=2026-05" and path.parent.parent.name == "aircraft=101"
    kept = pq.ParquetFile(path).read()
    saved = pq.read_table(fleet / name / "arrays" / "heading_samples.parquet")
    assert kept.column_names == list(MEANINGS) == list(json.loads(kept.schema.metadata[b"columns"]))
    for column, source in (("heading_deg", "heading_deg"), ("heading_error_deg", "difference_deg"), ("gate", "gate")):
        expected = [None if value != value else value for value in saved[source].to_pylist()]
        assert kept[column].to_pylist() == expected
    assert kept["heading_error_deg"].null_count == 40  # missing, never NaN: a database would average it
    times = kept["time_utc"].cast(pa.int64()).to_numpy() - START_NS
    assert times == pytest.approx(1e9 * saved["time_s"].to_numpy(), abs=1.0)
    assert set(kept["flight_id"].to_pylist()) == {name}


def test_moments_of_the_flights_are_those_of_the_samples(fleet: Path) -> None:
    found = pq.read_table(fleet / FLEET_PARQUET).to_pandas()
    for flight_id, path in sample_files(fleet).items():
        kept = pq.ParquetFile(path).read().to_pandas()
        own = moments_of(kept["heading_error_deg"][kept["is_used"]].to_numpy())
        row = found[found["flight_id"] == flight_id].iloc[0]
        assert (row["samples"], row["sample_mean_deg"]) == (own.count, pytest.approx(own.mean))
        assert row["sample_m2_deg2"] == pytest.approx(own.m2)


def test_only_what_changed_is_written_and_what_is_gone_is_removed(tmp_path: Path) -> None:
    folders = [save_flight(tmp_path, number, aircraft=f"A{number}") for number in range(4)]
    write(tmp_path)
    before = sample_files(tmp_path)
    for path in before.values():
        os.utime(path, (1, 1))
    (before[folders[0].name].parent / ".left.parquet.partial").write_bytes(b"PAR1")
    (tmp_path / SAMPLES / "notes.txt").write_text("of the crew")
    save_flight(tmp_path, 1, aircraft="A1", error_deg=2.0)
    save_flight(tmp_path, 2, aircraft="B2")
    shutil.rmtree(folders[3])
    write(tmp_path)
    after = sample_files(tmp_path)
    assert [name for name in after if after[name].stat().st_mtime == 1] == [folders[0].name]
    assert sorted(after) == [folder.name for folder in folders[:3]]
    assert after[folders[2].name].parent.parent.name == "aircraft=B2"
    left = sorted(path.name for path in (tmp_path / SAMPLES).rglob("*") if not path.name.startswith("month="))
    assert left == sorted(
        ["aircraft=A0", "aircraft=A1", "aircraft=B2", "notes.txt", *(f"{name}.parquet" for name in after)]
    )


def test_a_known_flight_is_not_read_again_by_another_process(tmp_path: Path) -> None:
    for number in range(3):
        save_flight(tmp_path, 20 * number)
    write(tmp_path)
    program = (
        "import sys; from pathlib import Path;"
        "from groundstation.pipeline.many_flights.fleet.scan import scan;"
        "found = scan(Path(sys.argv[1])); print(len(found.fresh), len(found.stale), len(found.months))"
    )
    told = subprocess.run([sys.executable, "-c", program, str(tmp_path)], capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["3", "0", "2"]


def test_a_month_is_written_again_by_what_changed_in_it_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = [save_flight(tmp_path, 10 * number) for number in range(6)]
    write(tmp_path)
    read: list[str] = []
    before = {path.name: path.stat().st_mtime_ns for path in (tmp_path / FLIGHTS).iterdir()}

    def share_of(folder: Path, store: SampleStore | None = None) -> FlightShare:
        read.append(folder.name)
        return fleet_rows.share_of(folder, store)

    monkeypatch.setattr("groundstation.pipeline.many_flights.fleet.refresh.share_of", share_of)
    write(tmp_path)
    assert read == []
    save_flight(tmp_path, 10, error_deg=4.0)
    shutil.rmtree(folders[0])
    save_flight(tmp_path, 100)
    write(tmp_path)
    assert read == [folders[1].name, "20260812T060000Z_100"]
    after = {path.name: path.stat().st_mtime_ns for path in (tmp_path / FLIGHTS).iterdir()}
    assert [name for name in before if after[name] != before[name]] == ["2026-05.parquet"]
    assert sorted(after) == ["2026-05.parquet", "2026-06.parquet", "2026-08.parquet"]
    for month, damaged in (("2026-05", b""), ("2026-06", b"PAR1")):
        (tmp_path / ".flights" / f"{month}.parquet").write_bytes(damaged)
    (tmp_path / FLIGHTS / "2026-08.parquet").unlink()
    kept = contents(tmp_path)
    write(tmp_path)  # all is made again, and as it was
    assert {name: kept[name] for name in kept} == {name: contents(tmp_path)[name] for name in kept}
    shutil.rmtree(tmp_path / "20260812T060000Z_100")
    write(tmp_path)
    assert not (tmp_path / FLIGHTS / "2026-08.parquet").exists()


@pytest.mark.parametrize("damage", ["empty", "no parquet", "another month", "a byte"])
def test_a_damaged_file_of_the_dataset_is_told_and_made_again(tmp_path: Path, damage: str) -> None:
    for number in range(2):
        save_flight(tmp_path, 30 * number)
    write(tmp_path)
    path, whole = tmp_path / FLIGHTS / "2026-05.parquet", contents(tmp_path)
    sound = path.read_bytes()
    column = pq.read_metadata(path).row_group(0).column(0)
    middle = column.dictionary_page_offset + column.total_compressed_size - 1
    other = (tmp_path / FLIGHTS / "2026-06.parquet").read_bytes()
    turned = sound[:middle] + bytes([sound[middle] ^ 0xFF]) + sound[middle + 1 :]
    path.write_bytes({"empty": b"", "no parquet": b"PAR1 no PAR1", "another month": other, "a byte": turned}[damage])
    with pytest.raises(GroundstationError, match=r"`report OUT`, makes it again"):
        gather(tmp_path)
    (told,) = write_beside(tmp_path, (), with_pdf=False, only_results=True)
    assert told.state == "skipped" and re.search(r"2026-05.parquet: damaged \(.+\), made again", told.text)
    assert contents(tmp_path) == whole and len(gather(tmp_path)) == 2
    assert write_beside(tmp_path, (), with_pdf=False, only_results=True) == ()


def test_a_large_fleet_says_where_its_rows_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(4):
        save_flight(tmp_path, number)
    write_beside(tmp_path, (), with_pdf=False)
    assert len(json.loads((tmp_path / "index.json").read_text())["rows"]) == 4
    for module in ("statistics", "index"):
        monkeypatch.setattr(f"groundstation.pipeline.many_flights.fleet.{module}.MOST_LISTED", 3)
    write_beside(tmp_path, (Outcome("broken.csv", "failed", "no header"),), with_pdf=False)
    index = json.loads((tmp_path / "index.json").read_text())
    assert index["elsewhere"] == "4 flights: flights.parquet/"
    assert [row["source"] for row in index["rows"]] == ["broken.csv"]
    assert (tmp_path / "index.csv").read_text().startswith("# 4 flights: flights.parquet/\nkind,")
    assert not (tmp_path / FLEET_PARQUET).exists()
    rows = pq.read_table(tmp_path / FLIGHTS)
    assert rows["flight_id"].to_pylist() == sorted(path.parent.name for path in tmp_path.glob("*/summary.json"))


def test_a_refresh_that_is_killed_is_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(4):
        save_flight(tmp_path / "whole", 20 * number)
        save_flight(tmp_path / "killed", 20 * number)
    write(tmp_path / "whole")
    for moment in range(1, 10):
        with monkeypatch.context() as patched:
            left = iter(range(moment))

            def killed(self: Path, target: Path, left: Iterator[int] = left, replace: Any = Path.replace) -> Path:
                if next(left, None) is None:
                    raise KeyboardInterrupt
                return Path(replace(self, target))

            patched.setattr(Path, "replace", killed)
            with suppress(KeyboardInterrupt):
                refresh(tmp_path / "killed")
        save_flight(tmp_path / "killed", 20 * (moment % 4))
    write(tmp_path / "killed")
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


def test_the_same_flights_give_the_same_bytes(fleet: Path, tmp_path: Path) -> None:
    for folder in sorted(fleet.iterdir(), reverse=True):
        if (folder / "summary.json").exists():
            shutil.copytree(folder, tmp_path / folder.name)
            if folder.name.endswith("_20"):
                write(tmp_path)
    again = write(tmp_path)
    assert contents(tmp_path) == contents(fleet)
    assert again.to_dict() == gather(fleet).to_dict()


def test_names_of_aircraft_never_leave_the_dataset(tmp_path: Path) -> None:
    from pyarrow import dataset

    names = [HOSTILE, "..", "x" * 500, "Ж" * 100, "a/b", ""]
    for number, name in enumerate(names):
        save_flight(tmp_path, number, aircraft=name)
    write(tmp_path)
    files = sample_files(tmp_path)
    assert len(files) == len(names)
    assert all(re.fullmatch(r"aircraft=[A-Za-z0-9_%-]{1,200}", path.parts[-3]) for path in files.values())
    read = dataset.dataset(tmp_path / SAMPLES, partitioning="hive").to_table(["aircraft", "flight_id"])
    pairs = set(zip(read["flight_id"].to_pylist(), read["aircraft"].to_pylist(), strict=True))
    found = [name for _, name in sorted(pairs)]
    assert found[0] == HOSTILE.replace("\udcff", "\\udcff") and found[1] == ".." and found[4:] == ["a/b", "unknown"]
    assert partition("Ж" * 100) != partition("Ж" * 101)


def test_what_cannot_be_read_is_named_and_keeps_its_samples(tmp_path: Path) -> None:
    folders = [save_flight(tmp_path, number) for number in range(4)]
    (tmp_path / "index.json").write_text(
        json.dumps({"rows": [{"kind": "skipped", "source": "z.bin", "reason": "no reader"}, {"kind": "flight"}, 7]})
    )
    write(tmp_path)
    samples = folders[2] / "arrays" / "heading_samples.parquet"
    samples.write_bytes(samples.read_bytes()[:4] + bytes(200) + b"PAR1")  # whole at its ends
    (folders[3] / "summary.json").write_text("[")
    results = write(tmp_path)
    assert len(results) == 2 and len(results.densities) == 2
    assert [(one.kind, Path(one.source).name) for one in results.not_in_fleet] == [
        ("failed", folders[2].name),
        ("failed", folders[3].name),
        ("skipped", "z.bin"),
    ]
    assert (
        "heading_samples.parquet" in results.not_in_fleet[0].reason and "summary.json" in results.not_in_fleet[1].reason
    )
    assert len(sample_files(tmp_path)) == 4


@pytest.mark.parametrize(
    "hostile",
    [None, "x", -1, 1e300, 10**400, [], {}, [[]], True, {"error_deg": 1e308}, {"skill": [{"starts": 10**400}]}],
    ids=repr,
)
def test_hostile_summaries_end_in_a_row_or_a_reason(tmp_path: Path, hostile: Any) -> None:
    for number in range(9):
        folder = save_flight(tmp_path, number, forecast=skill())
        summary = json.loads((folder / "summary.json").read_text())
        place: Any = summary
        for key in (("flight",), ("results",), ("results", "heading"), ("results", "heading", "error_deg"))[number % 4]:
            parent, place = place, place[key]
        parent[key] = hostile
        if number % 2:
            summary["flight"]["start_utc"] = hostile
            summary["results"] = {"heading": dict.fromkeys(("error_deg", "onboard", "runway", "samples"), hostile)}
        (folder / "summary.json").write_text(json.dumps(summary))
    results = write(tmp_path)
    assert len(results) + len(results.not_in_fleet) == 9
    json.dumps(results.to_dict(), allow_nan=False)


def test_a_flight_whose_samples_file_is_gone_stays_without_them(tmp_path: Path) -> None:
    folders = [save_flight(tmp_path, number) for number in range(3)]
    (folders[1] / "arrays" / "heading_samples.parquet").unlink()
    results = write(tmp_path)
    assert len(results) == 3 and len(results.densities) == 2
    assert np.isfinite(results.densities.pooled_per_deg).all()
    assert all(one.sample_mean_deg is not None and np.isfinite(one.sample_mean_deg) for one in results.by_aircraft)


def test_metadata_that_is_broken_is_told_and_stops_nothing(tmp_path: Path) -> None:
    broken, _whole = (save_flight(tmp_path, number) for number in range(2))
    path = broken / "arrays" / "heading_samples.parquet"
    for digits in (b"{", b"\xff", b"[1]", b'{"heading_deg": {}}'):
        table = pq.read_table(path).replace_schema_metadata({b"digits": digits})
        pq.write_table(table, path)
        assert [Path(one.source).name for one in write(tmp_path).not_in_fleet] == [broken.name]


def test_a_full_disk_is_told_and_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_flight(tmp_path, 1)
    write(tmp_path)
    old = contents(tmp_path)
    save_flight(tmp_path, 1, error_deg=3.0)
    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", lambda self, target: (_ for _ in ()).throw(OSError(28, "No space left")))
        found, problems = refresh(tmp_path)
        results, unwritten = write_fleet(tmp_path, found)
        problems += unwritten
    assert len(results) == 1 and contents(tmp_path) == old
    assert [problem.state for problem in problems] == ["failed", "failed"]
    assert all("No space left" in problem.text and "\n" not in problem.text for problem in problems)


def test_checks_and_skill_are_gathered(tmp_path: Path) -> None:
    for number in range(10):
        save_flight(
            *(tmp_path, number),
            verdict="reject" if number == 9 else "accept",
            reference_residual_arcmin=30.0 if number >= 8 else 1.5,
            parking_sigma_deg=0.04,
            onboard=OnboardComparison(1.0, None, None, None, None, "", 0.02),
            runway=(RunwayCheck("12", 120.0, 121.0, 1.0, 0.05, -0.2),),
            forecast=skill(rms_m=100.0 * (1 + number % 2), starts=1 + 2 * (number % 2)),
        )
    found = gather(tmp_path)
    reference, runway, onboard = found.calibration
    assert (reference.checks, reference.inside, onboard.inside, runway.inside) == (9, 8, 9, 0)
    sigma = np.hypot(0.04, 0.05)  # of the estimate and, as the log says nothing, of a stand
    assert found.calibration_checks["z"][0] == pytest.approx(0.025 / sigma)
    assert len(found.calibration_checks) == 30
    row = next(row for row in found.skill if (row.method, row.horizon_min) == ("last_estimate", 30.0))
    assert (row.flights, row.starts, row.coverage95) == (10, 20, pytest.approx(0.9))
    assert row.rms_m == pytest.approx(np.sqrt((100.0**2 + 3 * 200.0**2) / 4.0))
    assert set(found.skill_flights["method"].tolist()) == {"last_estimate"} and len(found.skill_flights) == 20
    assert found.stated["any_false_outlier_in_the_fleet"] == 0.05


def test_every_table_becomes_a_frame_and_plain_values(fleet: Path, tmp_path: Path) -> None:
    names = ("flights", "densities", "normals", "by_aircraft", "trend", "change_points", "skill", "skill_flights")
    names += ("calibration", "calibration_checks", "outliers", "not_in_fleet")
    full, empty = gather(fleet), gather(tmp_path)
    for name in names:
        assert list(full.to_frame(name).columns) == list(empty.to_frame(name).columns), name
        assert len(empty.to_frame(name)) == 0, name
    with pytest.raises(UsageError, match="one of flights"):
        full.to_frame("stated")
    assert str(full.to_frame()["start_utc"].dtype) == "datetime64[ns, UTC]"
    assert len(full.to_frame("densities")) == 13 * len(full.densities.center_deg)
    plain = json.loads(json.dumps(full.to_dict(), allow_nan=False))
    assert plain["flights"][0]["start_utc"] == "2026-05-04T06:00:00.000Z" and len(plain["by_aircraft"]) == 3
    assert full.aircraft == ("", "101", "A12")
    whole, own = full.normal(), full.normal("101")
    assert whole is not None and own is not None and whole.samples > own.samples and full.normal("none") is None
    write(tmp_path)
    assert pq.read_table(tmp_path / FLEET_PARQUET).num_rows == 0


def test_a_flight_without_time_is_kept_under_an_unknown_month(tmp_path: Path) -> None:
    folder = save_flight(tmp_path, 1)
    summary = json.loads((folder / "summary.json").read_text())
    summary["flight"]["start_utc"] = None
    (folder / "summary.json").write_text(json.dumps(summary))
    write(tmp_path)
    (path,) = sample_files(tmp_path).values()
    assert path.parent.name == "month=unknown" and pq.ParquetFile(path).read()["time_utc"].null_count == 400
    assert pq.read_table(tmp_path / FLEET_PARQUET)["start_utc"].to_pylist() == [None]


@pytest.mark.slow
def test_memory_does_not_grow_with_the_samples_of_the_flights(tmp_path: Path) -> None:
    for number in range(8):
        save_flight(tmp_path / ("few" if number < 2 else "many"), number, samples=20_000)
    peaks = []
    for name in ("few", "few", "many"):  # the first look imports
        tracemalloc.start()
        gather(tmp_path / name)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.5 * peaks[1]


def blocks() -> list[tuple[str, str]]:
    return re.findall(r"```python ([a-z ]+)\n(.*?)```", DOCS.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.parametrize(("name", "text"), blocks(), ids=lambda value: value if "\n" not in value else "")
def test_the_answers_of_the_docs_are_right(name: str, text: str, fleet: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name != "results":
        pytest.importorskip(name.split()[0])
    monkeypatch.chdir(fleet)
    *statements, last = ast.parse(text).body
    assert isinstance(last, ast.Expr)
    space: dict[str, Any] = {}
    exec(compile(ast.Module(statements, []), name, "exec"), space)
    answer = eval(compile(ast.Expression(last.value), name, "eval"), space)
    if name == "results":
        assert answer["aircraft"].tolist() == ["", "101", "A12"]
        return
    rows = _rows(name, answer)
    flights = pq.read_table(FLEET_PARQUET).to_pylist()
    assert len(rows) >= 4
    for aircraft, month, count, mean, sigma in rows:
        names = (None, "unknown") if aircraft in (None, "unknown") else (aircraft,)
        own = [one for one in flights if one["aircraft"] in names and one["month"] == month]
        if name.endswith("samples"):
            parts = [_moments(one) for one in own]
            expected = merged(parts)
        else:
            expected = moments_of([one["error_deg"] for one in own])
        assert count == expected.count and mean == pytest.approx(expected.mean)
        assert sigma is None or np.isnan(sigma) or sigma == pytest.approx(expected.sigma)


def _moments(row: dict[str, Any]) -> Any:
    from groundstation.methods.fleet.moments import Moments

    return Moments(row["samples"], row["sample_mean_deg"], row["sample_m2_deg2"])


def _rows(name: str, answer: Any) -> list[tuple[Any, ...]]:
    if name.startswith("duckdb"):
        return list(answer.fetchall())
    if name.startswith("polars"):
        return list(answer.rows())
    return [(*key, row["count"], row["mean"], row["std"]) for key, row in answer.iterrows() if row["count"]]


def test_simulated_logs_become_a_fleet(tmp_path: Path) -> None:
    logs = [REPOSITORY / "sample_logs" / f"taxi-{name}.csv" for name in ("good", "short")]
    run_many(logs, tmp_path, Configuration(), jobs=1, with_pdf=False)
    found = write(tmp_path)
    assert len(found) == 2 and len(found.densities) == 2 and found.not_in_fleet == ()
    checks = found.calibration_checks
    own = checks["z"][(checks["quantity"] == "reference") & (checks["verdict"] == "accept")]
    assert len(own) == 1 and (np.abs(own) < 3.0).all()
    assert found.flights["samples"].sum() == sum(found.densities.samples)
    assert len(sample_files(tmp_path)) == 2


def test_shares_read_as_flights_end_give_the_same_dataset(fleet: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(fleet, out, ignore=shutil.ignore_patterns(FLIGHTS, SAMPLES, FLEET_PARQUET, ".flights"))
    early = EarlyShares(out)
    early.read(["no such flight", *sorted(path.name for path in out.iterdir() if (path / "summary.json").exists())])
    found, unwritten = refresh(out, early=early)
    _results, problems = write_fleet(out, found)
    assert unwritten == problems == ()
    assert contents(out) == contents(fleet)


def test_a_share_is_read_once_and_again_where_its_flight_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_flight(tmp_path, 0, error_deg=0.5)
    save_flight(tmp_path, 4, error_deg=0.5)
    first, second = sorted(path.name for path in tmp_path.iterdir())
    early = EarlyShares(tmp_path)
    early.read((first, second))
    save_flight(tmp_path, 4, error_deg=2.5)
    read: list[str] = []
    monkeypatch.setattr(
        fleet_refresh, "share_of", lambda folder, store: (read.append(folder.name), share_of(folder, store))[1]
    )
    found, _ = refresh(tmp_path, early=early)
    results, _ = write_fleet(tmp_path, found)
    assert read == [second]
    assert results.flights["error_deg"].tolist() == [0.5, 2.5]
