"""`--reference FILE`: SBET without a date, another log, folders; truth that no estimator sees; bad references."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.records import Column
from groundstation.base.timescales import GPS_EPOCH_NS, leap_seconds_at, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.runs.references import judged_by
from groundstation.pipeline.one_flight import reference as beside
from groundstation.pipeline.one_flight.analyse import analyse
from groundstation.pipeline.one_flight.configuration import NO_REFERENCES, Configuration, References
from groundstation.pipeline.one_flight.convert import Converted, convert_log
from groundstation.pipeline.one_flight.flight import given_of, read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.one_flight.resume import keys_of
from groundstation.pipeline.verbs.conversions import convert_many
from groundstation.readers.sbet import RECORD
from groundstation.results.flight import FlightResults
from groundstation.results.summary import summary_of
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.flight import simulate
from groundstation.systems.reference.answer import ReferenceResult
from groundstation.tables.table import Flight
from tests.readers.bag_writer import small_flight, write_ros2
from tests.real_logs import real_log
from tests.simulated_flights import quiet

RESOLUTION_M = 0.05  # of the positions that the simulated CSV has
TIME_S = 1e-6


@pytest.fixture(scope="module")
def flown() -> Flight:
    return simulate(quiet(ins={"azimuth_error_deg": 1.0}, gnss={"position_white_m": 0.5})).flight


@pytest.fixture(scope="module")
def folder(flown: Flight, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log without its truth, and beside it the truth as an SBET without a date."""
    folder = tmp_path_factory.mktemp("beside")
    write_flat_csv(folder / "flight.csv", flown)
    (folder / "references").mkdir()
    (folder / "references" / "sbet.out").write_bytes(sbet_of(flown).tobytes())
    return folder


def sbet_of(flight: Flight, later_s: float = 0.0) -> np.ndarray:
    """The truth of a flight as records of an SBET; times are seconds of the GPS week, the wander angle is zero."""
    truth = flight["truth"].unique_times()
    records = np.zeros(len(truth), RECORD)
    since_epoch = truth.time_ns - GPS_EPOCH_NS + leap_seconds_at(int(truth.time_ns[0])) * NS_PER_S
    records["time"] = (since_epoch % (604_800 * NS_PER_S)) / NS_PER_S + later_s
    for name, field in (("latitude", "latitude_deg"), ("longitude", "longitude_deg"), ("roll", "roll_deg")):
        records[name] = np.deg2rad(truth.values(field))
    for name, field in (("pitch", "pitch_deg"), ("platform_heading", "true_heading_deg")):
        records[name] = np.deg2rad(truth.values(field))
    records["altitude"] = truth.values("altitude_ellipsoid_m")
    for name, axis in (("x_velocity", "north"), ("y_velocity", "east"), ("z_velocity", "down")):
        records[name] = truth.values(f"velocity_{axis}_mps")
    return records


def converted(log: Path, target: Path, *references: Path, is_expected: bool = True) -> tuple[Converted, Flight]:
    found = References(references, is_expected) if references else NO_REFERENCES
    made = convert_log(open_log(log), target, references=found)
    return made, read_flight(target, made)


def results_of(log: Path, target: Path, *references: Path) -> FlightResults:
    made, flight = converted(log, target, *references)
    return analyse(flight, given_of(open_log(log), made, "A"), Configuration())


def test_an_sbet_without_a_date_is_the_truth_of_its_flight(folder: Path, flown: Flight, tmp_path: Path) -> None:
    made, flight = converted(folder / "flight.csv", tmp_path / "a.mcap", folder / "references" / "sbet.out")
    truth = flight["truth"]
    near = np.clip(np.searchsorted(flown["truth"].time_ns, truth.time_ns), 0, len(flown["truth"]) - 1)
    assert np.abs(truth.time_ns - flown["truth"].time_ns[near]).min() < 1e3
    assert truth.values("true_heading_deg") == pytest.approx(flown["truth"].values("true_heading_deg")[near], abs=1e-3)
    assert flight.metadata["truth.source_name"] == "sbet.out"
    assert {"reference.laid", "reference.week"} <= {finding.code for finding in made.findings}
    assert made.info.ledger.topics["truth"].rows == len(truth)


def test_results_are_the_same_with_and_without_it(folder: Path, tmp_path: Path) -> None:
    """But for the judgement, what is told of the reference itself, and its place in the ledger."""
    log = folder / "flight.csv"
    with_it = results_of(log, tmp_path / "a.mcap", folder / "references" / "sbet.out")
    without = results_of(log, tmp_path / "b.mcap")
    one, other = (json.loads(json.dumps(summary_of(found), default=str)) for found in (with_it, without))
    judgement = one["results"].pop("reference")
    assert judgement["is_judge"]
    assert one["results"] == other["results"]
    assert [entry for entry in one["findings"] if not entry["code"].startswith("reference.")] == other["findings"]
    assert one["not_assessable"] == other["not_assessable"]
    for name in without.figure_names:
        ours, theirs = with_it.figure(name), without.figure(name)
        assert ours is not None and theirs is not None
        assert all(
            np.array_equal(ours[column], theirs[column], equal_nan=ours[column].dtype.kind == "f")
            for column in theirs.columns
        )
    assert with_it.duration_s == without.duration_s
    assert with_it.start_utc_ns == without.start_utc_ns
    found = with_it.answer(ReferenceResult)
    assert found is not None
    row = found.error("ins", "attitude", "heading")
    assert row is not None
    assert row.spread.mean == pytest.approx(1.0, abs=0.01)


def test_another_log_judges_and_an_mcap_takes_another_reference(folder: Path, flown: Flight, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    tables = {"ins": replace(flown["truth"], topic="ins")}
    write_flat_csv(other, replace(flown, tables=tables))
    made, flight = converted(folder / "flight.csv", tmp_path / "a.mcap", other)
    assert flight.metadata["truth.topic"] == "ins"
    again, second = converted(tmp_path / "a.mcap", tmp_path / "b.mcap", folder / "references" / "sbet.out")
    assert second.metadata["truth.source_name"] == "sbet.out"
    assert len(second["truth"]) == again.info.ledger.topics["truth"].rows
    kept, third = converted(tmp_path / "b.mcap", tmp_path / "c.mcap")
    assert third.metadata == second.metadata
    assert len(third["truth"]) == len(second["truth"])
    assert kept.info.findings == again.info.findings
    assert made.info.start_ns == flown.start_ns


def test_what_cannot_judge_is_refused_in_one_line(folder: Path, flown: Flight, tmp_path: Path) -> None:
    log, good = folder / "flight.csv", folder / "references" / "sbet.out"
    other_day = tmp_path / "sbet_20200101.out"
    other_day.write_bytes(good.read_bytes())
    no_time = tmp_path / "notime.csv"
    no_time.write_text("time_s,ins.true_heading_deg\n0,1\n1,1\n", encoding="utf-8")
    drifting = tmp_path / "drifting.csv"
    drifting.write_text("time_s,ins.latitude_deg,ins.longitude_deg\n0,1,1\n1,1,1\n", encoding="utf-8")
    nothing = tmp_path / "nothing.csv"
    nothing.write_text("time_utc,baro.pressure_altitude_m\n2026-05-04T06:00:00Z,1\n", encoding="utf-8")
    own = tmp_path / "own.csv"
    write_flat_csv(own, flown, with_truth=True)
    for used, references, told in (
        (log, [other_day], "expected one that covers flight.csv"),
        (log, [good, folder / "references" / ".." / "references" / "sbet.out"], "several references"),
        (no_time, [good], "a log without UTC"),
        (log, [drifting], "no UTC"),
        (log, [nothing], "no position, velocity or attitude"),
        (own, [good], "a truth of its own"),
    ):
        with pytest.raises(GroundstationError, match=told) as raised:
            converted(used, tmp_path / "x.mcap", *references)
        assert "\n" not in str(raised.value)
    stored = tmp_path / "notime.mcap"
    converted(no_time, stored)
    with pytest.raises(GroundstationError, match="a log without UTC"):
        converted(stored, tmp_path / "x.mcap", good)
    for used in (log, no_time, stored):
        made, flight = converted(used, tmp_path / "x.mcap", other_day, is_expected=False)
        assert "truth" not in flight
        assert "reference.none" in {finding.code for finding in made.findings}


def test_a_damaged_reference_keeps_its_intact_part(folder: Path, tmp_path: Path) -> None:
    content = bytearray((folder / "references" / "sbet.out").read_bytes())
    content[40 * RECORD.itemsize : 41 * RECORD.itemsize] = bytes(np.full(17, np.nan).tobytes())
    damaged = tmp_path / "sbet.out"
    damaged.write_bytes(bytes(content[:-50]))
    made, flight = converted(folder / "flight.csv", tmp_path / "a.mcap", damaged)
    assert len(flight["truth"]) == len(content) // RECORD.itemsize - 2
    (finding,) = (one for one in made.findings if one.code == "reference.damaged")
    assert finding.severity == "warn"
    assert not made.has_lost_data


def test_folders_of_references(folder: Path, tmp_path: Path) -> None:
    (folder / "references" / "notes.txt").write_text("who flew", encoding="utf-8")
    found = judged_by(Configuration(), [folder / "references"], is_one_log=True).references
    assert [path.name for path in found.paths] == ["sbet.out"]
    assert judged_by(Configuration(), (), is_one_log=True).references == NO_REFERENCES
    with pytest.raises(UsageError, match="no such file"):
        judged_by(Configuration(), [tmp_path / "none.out"], is_one_log=True)
    with pytest.raises(GroundstationError):
        judged_by(Configuration(), [folder / "references" / "notes.txt"], is_one_log=True)
    (tmp_path / "empty").mkdir()
    with pytest.raises(UsageError, match="no reference in it"):
        judged_by(Configuration(), [tmp_path / "empty"], is_one_log=False)
    configuration = judged_by(Configuration(), [folder / "references"], is_one_log=True)
    (outcome,) = convert_many([folder / "flight.csv"], tmp_path / "a.mcap", configuration=configuration)
    assert outcome.state == "done"


def test_of_a_folder_a_flight_takes_the_file_of_its_time(
    folder: Path, flown: Flight, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What cannot be read is told; a file of another time is read once, however many flights are judged."""
    references = [tmp_path / f"sbet_2020010{day}.out" for day in range(1, 7)]
    for path in references:
        path.write_bytes((folder / "references" / "sbet.out").read_bytes())
    no_time = tmp_path / "notime.csv"
    no_time.write_text("time_s,ins.latitude_deg,ins.longitude_deg\n0,1,1\n1,1,1\n", encoding="utf-8")
    own_time = folder / "references" / "sbet.out"
    opened: list[Path] = []
    monkeypatch.setattr(beside, "open_log", lambda path: opened.append(path) or open_log(path))
    for number in range(2):
        paths = (*references, no_time, own_time)
        made, flight = converted(folder / "flight.csv", tmp_path / f"{number}.mcap", *paths, is_expected=False)
        assert len(flight["truth"]) == len(flown["truth"].unique_times())
        assert [one.severity for one in made.findings if one.code == "reference.unreadable"] == ["warn"]
    assert [opened.count(path) for path in references] == [1] * 6


def test_what_a_reference_does_not_trust_is_no_truth(folder: Path, flown: Flight, tmp_path: Path) -> None:
    true = replace(flown["truth"], topic="ins")
    modes = np.where(np.arange(len(true)) < 50, "align", "nav")
    other = tmp_path / "other.csv"
    marked = replace(true, columns={**true.columns, "mode": Column(modes)})
    write_flat_csv(other, replace(flown, tables={"ins": marked}))
    _made, flight = converted(folder / "flight.csv", tmp_path / "a.mcap", other)
    assert len(flight["truth"]) == len(true) - 50


def test_gps_time_of_a_recorded_solution_becomes_utc(tmp_path: Path) -> None:
    """The solution is the receiver's own: the same to a millimetre once 18 leap seconds are taken off."""
    log, solution = real_log("gnss/walk_0827_gnss_1730.ubx"), real_log("gnss/walk_0827_gnss_1730_sf.pos")
    answer = results_of(log, tmp_path / "a.mcap", solution).answer(ReferenceResult)
    assert answer is not None
    row = answer.error("gnss", "position", "horizontal")
    assert row is not None
    assert row.spread.rmse < 0.002
    assert not answer.is_judge


def test_what_is_read_along_with_a_reference_counts_in_what_a_run_need_not_do_again(
    folder: Path, tmp_path: Path
) -> None:
    """The accuracies beside an SBET, the files of a bag: with others a run that is continued begins anew."""
    sbet = tmp_path / "sbet_20260504.out"
    sbet.write_bytes((folder / "references" / "sbet.out").read_bytes())
    bag = write_ros2(tmp_path / "bag", small_flight())
    source = open_log(folder / "flight.csv").source

    def key(reference: Path) -> str:
        configuration = Configuration(references=References((reference,)))
        return keys_of(source, configuration).conversion

    (inside,) = bag.glob("*.mcap")
    for reference, other in ((sbet, tmp_path / "smrmsg_20260504.out"), (bag, inside), (bag / "metadata.yaml", inside)):
        before = key(reference)
        assert key(reference) == before
        other.write_bytes((other.read_bytes() if other.exists() else b"") + b"other")
        assert key(reference) != before
    sha256 = open_log(sbet).source.sha256
    (tmp_path / "smrmsg_20260504.out").write_bytes(b"still others")
    assert open_log(sbet).source.sha256 != sha256, "they are a part of the log"
    assert open_log(sbet).source.name == sbet.name


def test_a_log_for_which_a_reference_is_expected_is_not_finished_by_a_run_that_expected_none(
    folder: Path, tmp_path: Path
) -> None:
    elsewhere = tmp_path / "elsewhere.csv"
    elsewhere.write_text(
        "# start_utc: 2001-01-01T00:00:00Z\ntime_s,ins.latitude_deg,ins.longitude_deg\n0,1,1\n1,1,1\n", encoding="utf-8"
    )
    log = tmp_path / "logs" / "flight.csv"
    log.parent.mkdir()
    log.write_bytes((folder / "flight.csv").read_bytes())
    run = ["-o", str(tmp_path / "out"), "-q", "--only", "results", "--reference", str(elsewhere)]
    assert CliRunner().invoke(app, ["run", str(log.parent), *run]).exit_code == 0
    refused = CliRunner().invoke(app, ["run", str(log), *run])
    assert refused.exit_code == 1
    assert "a reference that covers" in refused.output


def two_in_one(flown: Flight, path: Path, *, drift_m: float = 0.0, sign: float = 1.0) -> Path:
    """A flat table with an INS and the GNSS that corrects it; the INS may drift, its vertical velocity be upward."""
    truth = flown["truth"].unique_times()
    truth = truth.take(slice(0, None, max(1, len(truth) // 3000)))
    time_s = (truth.time_ns - truth.time_ns[0]) / NS_PER_S
    latitude, longitude = (truth.values(f"{name}_deg") for name in ("latitude", "longitude"))
    height, down = 200.0 + 60.0 * np.sin(0.05 * time_s), -sign * 3.0 * np.cos(0.05 * time_s)
    off = drift_m / 111_000.0 * time_s / time_s[-1]
    ins = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "velocity_down_mps")
    gnss = ("latitude_deg", "longitude_deg", "horizontal_sigma_m")
    head = ["time_s", *(f"ins.{name}" for name in ins), *(f"gnss.{name}" for name in gnss)]
    lines = [f"# start_utc: {utc_ns_to_iso(int(truth.time_ns[0]), 9)}", ",".join(head)]
    for row in zip(time_s, latitude + off, longitude, height, down, latitude, longitude, strict=True):
        lines.append(",".join(f"{value:.9f}" for value in row) + ",1.0")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(("drift_m", "topic"), [(5.0, "ins"), (900.0, "gnss")])
def test_of_a_file_with_both_the_ins_judges_unless_it_drifts(
    drift_m: float, topic: str, folder: Path, flown: Flight, tmp_path: Path
) -> None:
    reference = two_in_one(flown, tmp_path / "both.csv", drift_m=drift_m)
    _, flight = converted(folder / "flight.csv", tmp_path / "a.mcap", reference)
    assert flight.metadata["truth.topic"] == topic
    named = References((reference,), is_expected=True, topic="gnss")
    made = convert_log(open_log(folder / "flight.csv"), tmp_path / "b.mcap", references=named)
    assert read_flight(tmp_path / "b.mcap", made).metadata["truth.topic"] == "gnss"
    with pytest.raises(GroundstationError, match=r"no topic gnss\.7"):
        convert_log(open_log(folder / "flight.csv"), tmp_path / "c.mcap", references=replace(named, topic="gnss.7"))


def test_a_user_names_the_topic_of_a_reference(folder: Path) -> None:
    configuration = Configuration({"reference": {"topic": "gnss"}})
    found = judged_by(configuration, [folder / "references"], is_one_log=True)
    assert found.references.topic == "gnss" and found.references.is_expected


def test_a_reference_whose_vertical_velocity_is_upward_does_not_judge_it(
    folder: Path, flown: Flight, tmp_path: Path
) -> None:
    for sign, is_kept in ((1.0, True), (-1.0, False)):
        reference = two_in_one(flown, tmp_path / f"both{sign:.0f}.csv", sign=sign)
        made, flight = converted(folder / "flight.csv", tmp_path / f"a{sign:.0f}.mcap", reference)
        assert flight["truth"].has("velocity_down_mps") == is_kept
        told = [one.text for one in made.findings if one.code == "reference.vertical_velocity"]
        assert len(told) == (not is_kept) and all("vertical velocity is not judged" in one for one in told)
