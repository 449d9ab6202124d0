"""clip --anonymous: names, places and dates are gone, and the analyses answer as before."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.base.angles import wrap_180
from groundstation.base.errors import UsageError
from groundstation.base.records import Column, RecordBatch
from groundstation.cli.main import app
from groundstation.pipeline.one_flight.analyse import known_of, run_analyses, seen_by_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.verbs.anonymous import LEFT_OUT, WEEK_NS, Disguise
from groundstation.pipeline.verbs.clip import Wanted, clip
from groundstation.results.answer import Answer
from groundstation.store.info import StoreInfo
from groundstation.store.reader import read_info
from groundstation.store.writer import StoreWriter
from groundstation.systems import systems
from groundstation.systems.known import no_runways
from groundstation.tables.headings import true_heading
from groundstation.tables.table import Flight
from tests.real_logs import real_log
from tests.systems.inertial.flights import batch_of, flight_of, without_rows
from tests.systems.landing.example import approach_scenario, flown
from tests.systems.magnetic.example import START_NS, make, table

SAMPLES = Path(__file__).parents[1] / "sample_logs"
SEED = 20260504
# What is left of a difference of two longitudes after both were turned, in metres and degrees of heading.
ROUNDING_M, ROUNDING_DEG = 1e-6, 1e-6
MODEL_DEG = 0.02  # declination is interpolated between knots of the model, at other places after the turn


def stored(flight: Flight, path: Path, **facts: str) -> Path:
    """A flight as an MCAP of ours."""
    info = StoreInfo("secret.csv", "ab" * 32, "flat-csv of secret.toml", metadata=facts, has_utc=flight.has_utc)
    with StoreWriter(path, replace(info, start_ns=flight.start_ns)) as writer:
        for one in flight.tables.values():
            writer.write(RecordBatch(one.topic, one.record_index, one.device_time_ns, one.columns, one.time_ns))
    return path


def opened(path: Path, folder: Path) -> Flight:
    again = folder / f"again-{path.stem}.mcap"
    return read_flight(again, convert_log(open_log(path), again))


def disguised(path: Path, folder: Path, seed: int | None = SEED) -> Path:
    target = folder / f"part-{path.stem}.mcap"
    clip(path, target, Wanted(anonymous=True, seed=seed), with_recording=False, force=True)
    return target


def answer(flight: Flight, name: str) -> Answer:
    """What an analysis says of a flight; it fails where it says nothing."""
    configuration = Configuration({"heading": {"runs": "all_ground"}})  # a recorded log taxies straight after landing
    seen = seen_by_analyses(flight, configuration)
    (analysis,) = (one for one in systems().analyses if one.name == name)
    known = replace(known_of(seen, configuration), find_runways=no_runways)  # where the disguise puts it there is none
    found = run_analyses((analysis,), seen, known)
    assert name in found.answers, found.reasons
    answered: Answer = found.answers[name]
    return answered


def numbers_of(document: Any, path: str = "") -> Mapping[str, float]:
    """Every number of an answer by its place, without figures, and what is of the place or the date."""
    if isinstance(document, bool) or document is None or isinstance(document, str):
        return {}
    if isinstance(document, (int, float)):
        return {path: float(document)}
    entries = document.items() if isinstance(document, Mapping) else enumerate(document)
    return {
        key: value
        for name, part in entries
        if "longitude" not in str(name) and name != "figures"
        for key, value in numbers_of(part, f"{path}/{name}").items()
    }


def assert_equal_answers(one: Answer, other: Answer, tolerance: float) -> None:
    from groundstation.base.serial import to_json_exactly

    before, after = (numbers_of(to_json_exactly(replace(part, figures=()))) for part in (one, other))  # type: ignore[type-var]
    assert before.keys() == after.keys()
    assert len(before) > 10
    for key, value in before.items():
        assert after[key] == pytest.approx(value, rel=1e-6, abs=tolerance), key


@pytest.fixture(scope="module")
def taxi(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The MCAP of the accepted sample log, and the same in disguise."""
    folder = tmp_path_factory.mktemp("taxi")
    whole = folder / "whole.mcap"
    convert_log(open_log(SAMPLES / "taxi-good.csv"), whole)
    return whole, disguised(whole, folder)


def test_the_heading_answer_is_the_same(taxi: tuple[Path, Path], tmp_path: Path) -> None:
    before, after = (answer(opened(path, tmp_path), "heading") for path in taxi)
    assert_equal_answers(before, after, ROUNDING_DEG)


def test_a_true_heading_made_of_a_magnetic_one_is_the_same(tmp_path: Path) -> None:
    made = make().flight
    ins = made["ins"]
    columns = {**ins.columns, "magnetic_heading_deg": Column(ins.values("true_heading_deg"))}
    columns.pop("true_heading_deg")
    whole = stored(replace(made, tables={"ins": replace(ins, columns=columns)}), tmp_path / "compass.mcap")
    before, after = (
        true_heading(opened(path, tmp_path), "ins").values_deg for path in (whole, disguised(whole, tmp_path))
    )
    assert np.abs(wrap_180(after - before)).max() < MODEL_DEG


def test_the_inertial_answer_is_the_same(tmp_path: Path) -> None:
    flight = flight_of(batch_of())
    for topic in ("ins", "gnss"):
        flight = without_rows(flight, topic, flight.time_s(topic) < 1200.0)
    whole = stored(flight, tmp_path / "long.mcap", ins_class="navigation")
    before, after = (answer(opened(path, tmp_path), "inertial") for path in (whole, disguised(whole, tmp_path)))
    assert_equal_answers(before, after, ROUNDING_M)


def test_the_approach_is_the_same_by_its_course(tmp_path: Path) -> None:
    whole = stored(flown(approach_scenario())[0].flight, tmp_path / "approach.mcap")
    before, after = (answer(opened(path, tmp_path), "landing") for path in (whole, disguised(whole, tmp_path)))
    assert_equal_answers(before, after, 1e-3)


def test_what_names_the_flight_is_gone(taxi: tuple[Path, Path]) -> None:
    whole, part = (read_info(path) for path in taxi)
    named = {value for key, value in whole.metadata.items() if key in ("aircraft", "flight")}
    told = json.dumps({**part.to_strings({})})
    for word in (*named, whole.source_name, whole.source_sha256, "2026-05", "taxi-good"):
        assert word and word not in told
    assert taxi[1].stem not in told, "a file that is renamed would still tell its first name"
    assert not any(topic.startswith("raw.") for topic in part.ledger.topics)


def test_places_are_turned_and_times_are_moved_by_weeks(taxi: tuple[Path, Path], tmp_path: Path) -> None:
    before, after = (opened(path, tmp_path) for path in taxi)
    disguise = Disguise(SEED, before.start_ns)
    turned = wrap_180(after["gnss"].values("longitude_deg") - before["gnss"].values("longitude_deg"))
    known = np.isfinite(turned)
    assert known.any()
    assert np.allclose(wrap_180(turned[known] - disguise.shift_deg), 0.0, atol=1e-12)
    assert np.array_equal(after["gnss"].values("latitude_deg"), before["gnss"].values("latitude_deg"), equal_nan=True)
    assert (after.start_ns - before.start_ns) % WEEK_NS == 0
    assert after.start_ns < before.start_ns - 20 * WEEK_NS
    assert after.duration_s == before.duration_s


def test_flight_time_zero_stays_though_what_began_first_is_left_out(tmp_path: Path) -> None:
    made = make().flight
    early = table("raw.boot", made["ins"].time_ns[:3] - 5_000_000_000, {"state": np.arange(3.0)})
    whole = stored(
        Flight({"raw.boot": early, **made.tables}, {}, int(early.time_ns[0]), True, "a"), tmp_path / "a.mcap"
    )
    before, after = (opened(path, tmp_path) for path in (whole, disguised(whole, tmp_path)))
    assert after.time_s("ins")[0] == before.time_s("ins")[0] == 5.0


def test_what_has_nothing_but_left_out_topics_is_refused(tmp_path: Path) -> None:
    made = make().flight
    whole = stored(made.without("ins"), tmp_path / "a.mcap")
    with pytest.raises(UsageError, match="no record"):
        disguised(whole, tmp_path)


def test_the_same_seed_gives_the_same_bytes_and_no_seed_others(taxi: tuple[Path, Path], tmp_path: Path) -> None:
    whole, part = taxi
    again = tmp_path / part.name
    clip(whole, again, Wanted(anonymous=True, seed=SEED), with_recording=False)
    assert again.read_bytes() == part.read_bytes()
    clip(whole, again, Wanted(anonymous=True), with_recording=False, force=True)
    assert again.read_bytes() != part.read_bytes()


def test_topics_that_tell_the_place_and_texts_are_left_out() -> None:
    disguise = Disguise(SEED, START_NS)
    for topic in (*LEFT_OUT, "raw.gps", "satellite.12", "magnetometer.2"):
        assert disguise.topic(topic) is None
    rows = np.arange(2)
    text = Column(np.array(["RA-12345 engine start", ""]))
    batch = RecordBatch("onboard", rows, Column(rows), {"status": text}, START_NS + rows)
    shown = disguise.batch(batch)
    assert shown is not None and not shown.columns
    event = disguise.batch(replace(batch, topic="event", columns={"name": text}))
    assert event is not None and "RA" not in str(event.columns["name"].values)


def test_a_session_stays_one_under_one_seed() -> None:
    disguise = Disguise(SEED, START_NS)
    facts = disguise.info(StoreInfo(metadata={"aircraft": "RA-1"}, start_ns=START_NS, has_utc=True))
    assert disguise.topic("link.RA-1") == f"link.{facts.metadata['aircraft']}"
    rows = np.arange(1)
    place = {
        f"position_{axis}_m": Column(np.array([value])) for axis, value in zip("xyz", (4e6, 3e6, 4e6), strict=True)
    }
    spread = np.diag([4.0, 1.0, 9.0])
    pairs = {f"covariance_{a}{b}_m2": Column(np.array([spread["xyz".index(a), "xyz".index(b)]])) for a, b in
             ("xx", "xy", "xz", "yy", "yz", "zz")}  # fmt: skip
    shown = disguise.batch(RecordBatch("link.RA-1", rows, Column(rows), {**place, **pairs}, START_NS + rows))
    assert shown is not None
    x, y, z = (float(shown.columns[f"position_{axis}_m"].values[0]) for axis in "xyz")
    assert (np.hypot(x, y), z) == (pytest.approx(5e6), 4e6)
    turned = np.rad2deg(np.arctan2(y, x) - np.arctan2(3e6, 4e6))
    assert float(wrap_180(turned - disguise.shift_deg)) == pytest.approx(0.0, abs=1e-9)
    xx, xy, yy = (float(shown.columns[f"covariance_{pair}_m2"].values[0]) for pair in ("xx", "xy", "yy"))
    assert sorted(np.linalg.eigvalsh([[xx, xy], [xy, yy]])) == pytest.approx([1.0, 4.0])


def test_dates_among_other_times_are_moved_and_counters_are_not() -> None:
    disguise = Disguise(SEED, START_NS)
    rows = np.arange(2)
    sent = {"transmission_time_s": Column(np.array([START_NS / 1e9, 12.5]))}
    shown = disguise.batch(RecordBatch("link.A", rows, Column(np.array([START_NS, 7])), sent, START_NS + rows))
    assert shown is not None
    assert (shown.device_time_ns.values - [START_NS, 7]).tolist() == [disguise.shift_ns, 0]
    moved_s = shown.columns["transmission_time_s"].values - sent["transmission_time_s"].values
    assert moved_s.tolist() == [disguise.shift_ns / 1e9, 0.0]


def test_a_seed_alone_is_a_usage_error(tmp_path: Path) -> None:
    target = str(tmp_path / "a.mcap")
    result = CliRunner().invoke(app, ["clip", str(SAMPLES / "taxi-short.csv"), "--seed", "1", "-o", target])
    assert result.exit_code == 2


@pytest.mark.parametrize("name", ["landing", "heading"])
def test_a_recorded_flight_answers_as_before(name: str, tmp_path: Path) -> None:
    whole = tmp_path / "whole.mcap"
    convert_log(open_log(real_log("g1000/log_210623_141501_TEST1.csv")), whole)
    before, after = (answer(opened(path, tmp_path), name) for path in (whole, disguised(whole, tmp_path)))
    assert_equal_answers(before, after, MODEL_DEG)


def test_of_the_head_of_a_log_known_keys_with_known_values_stay(tmp_path: Path) -> None:
    told = {
        "derived.ins.true_heading_deg": "magnetic heading of RA-1",
        "derived.ins.RA-1": "RA-1",
        "derived.RA-1": "RA-1",
        "heading_is_track.ins.true_heading_deg": "the nose of RA-1",
        "ins_class": "RA-1",
        "ins_kind": "RA-1",
        "always_on_ground": "RA-1",
        "vehicle": "RA-1",
        "reference.parking_heading_deg": "RA-1",
        "reference.parking_heading_sigma_deg": "0.02",
        "clip.from_s": "RA-1",
        "derived_from": "RA-1",
    }
    info = replace(StoreInfo("a.csv", "ab" * 32, "flat-csv"), metadata=told)
    shown = Disguise(SEED, START_NS).info(info)
    assert "RA-1" not in json.dumps({**shown.metadata, **shown.to_strings({})})
    kept = dict(shown.metadata)
    kept.pop("anonymous")
    assert kept == {
        "derived.ins.true_heading_deg": "magnetic",
        "heading_is_track.ins.true_heading_deg": "heading_is_track",
        "reference.parking_heading_sigma_deg": "0.02",
    }
    facts = {"ins_class": "navigation", "ins_kind": "unaided", "always_on_ground": "true", "vehicle": "rolls"}
    assert facts.items() <= Disguise(SEED).info(replace(info, metadata=facts)).metadata.items()


def test_topics_left_out_do_not_move_flight_time_zero(tmp_path: Path) -> None:
    made = make().flight
    early = table("raw.boot", made["ins"].time_ns[:3] - 4_700_000_000, {"state": np.arange(3.0)})
    zero_ns = int(early.time_ns[0])
    whole = stored(Flight({"raw.boot": early, **made.tables}, {}, zero_ns, True, "a"), tmp_path / "a.mcap")
    for name, wanted in (("plain", Wanted(topics=("ins",))), ("disguised", Wanted(None, None, ("ins",), True, SEED))):
        part = tmp_path / f"{name}.mcap"
        clip(whole, part, wanted, with_recording=False)
        assert opened(part, tmp_path).time_s("ins")[0] == pytest.approx(4.7), name
        assert float(read_info(part).metadata["clip.zero_s"]) == 0.0
