"""Errors of clocks put into a simulated flight: each is found, and its size is that of the truth."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from groundstation.base.records import Column, Int64Array
from groundstation.base.serial import to_json_exactly
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.chapters.parts import Facts, Grid
from groundstation.chapters.quality import quality
from groundstation.cli.check_table import text_of
from groundstation.integrity import Survey, ledger_findings, survey
from groundstation.integrity.clock_relation import ROLLOVER_S
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.verbs.check import check_many
from groundstation.pipeline.verbs.conversions import convert_many
from groundstation.readers import registry
from groundstation.simulation.faults import BackwardStep, ClockDrift, Dropout, Fault, ForwardStep, apply_faults
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.flight import simulate
from groundstation.tables.table import Flight
from tests.readers.dataflash_writer import DataFlash
from tests.readers.ulog_writer import GPS, GPS_CODE, UlogWriter
from tests.report_example import example
from tests.simulated_flights import quiet

UTC = "2026-05-04T06:00:00Z"
UTC_NS = iso_to_utc_ns(UTC)[0]
SECONDS = 900
YEARS_53_S = 53 * 31_557_600
LATENCY_S, JITTER_S, SEED = 0.05, 0.004, 7
SIGMAS = 4.0  # of a standard error that is told with the figure
STEP_S = 0.02  # a step is placed between rows 0.1 s apart by their nominal period; latency beside it
PERIOD_S = 0.1
Told = Callable[[Int64Array], Int64Array]


@cache
def flight() -> Flight:
    """A parked aircraft's GNSS at 10 Hz, and its recorder's rows."""
    whole = simulate(quiet(legs=[{"kind": "parked", "duration_s": SECONDS}], gnss={"rate_hz": 10})).flight
    return replace(whole, tables={"gnss": whole["gnss"]})


def right(true_ns: Int64Array) -> Int64Array:
    """GNSS time as it is."""
    return true_ns


def off_by(seconds: float, before_s: float = np.inf) -> Told:
    """GNSS time that is wrong until a flight second."""
    return lambda true_ns: (
        true_ns + np.where(true_ns - UTC_NS < min(before_s, 1e9) * NS_PER_S, round(seconds * NS_PER_S), 0)
    )


@dataclass(frozen=True)
class Case:
    """Faults, what GNSS tells, and what must be found: quantities with their tolerance, codes of findings."""

    name: str
    faults: tuple[Fault, ...] = ()
    told: Told = right
    start_utc: str = UTC
    expected: tuple[tuple[str, float, float], ...] = ()  # quantity, truth, tolerance (0: by the standard error told)
    codes: frozenset[str] = frozenset()
    is_absolute: bool = True
    start: str = "utc"


CASES = (
    Case("nothing is wrong", expected=(("drift_ppm", 0.0, 0.0), ("offset_s", -LATENCY_S, 0.002), ("segments", 1, 0.1))),
    Case(
        "an epoch jump of 53 years",
        (ForwardStep(at_s=60.0, step_s=YEARS_53_S),),
        lambda true_ns: true_ns - UTC_NS + YEARS_53_S * NS_PER_S,
        "1970-01-01T00:00:00Z",
        (("step_s", YEARS_53_S, STEP_S), ("offset_s", -LATENCY_S, STEP_S), ("segments", 1, 0.1)),
        frozenset({"clock.forward_step", "clock.unset"}),
        start="unset",
    ),
    Case(
        "a backward step of 5 s",
        (BackwardStep(at_s=300.0, step_s=5.0),),
        lambda true_ns: true_ns - 5 * NS_PER_S,
        expected=(("step_s", -5.0, STEP_S), ("segments", 1, 0.1), ("drift_ppm", 0.0, 0.0)),
        codes=frozenset({"clock.backward_step"}),
    ),
    Case(
        "a recorder that was off for 60 s and began again",
        (Dropout(from_s=400.0, to_s=460.0), BackwardStep(at_s=460.0, step_s=460.0)),
        expected=(("segments", 1, 0.1), ("offset_s", -LATENCY_S / 2, LATENCY_S / 2)),  # by the time that GNSS told
        codes=frozenset({"data.sequence", "data.gaps"}),
    ),
    Case(
        "a missing sequence",
        (Dropout(from_s=200.0, to_s=203.0),),
        expected=(("lost", 30, 0.1), ("segments", 1, 0.1)),
        codes=frozenset({"data.sequence", "data.gaps"}),
    ),
    Case("a drift of 50 ppm", (ClockDrift(at_s=0.0, drift_ppm=50.0),), expected=(("drift_ppm", 50.0, 0.0),)),
    Case(
        "a drift of -300 ppm",
        (ClockDrift(at_s=0.0, drift_ppm=-300.0),),
        expected=(("drift_ppm", -300.0, 0.0),),
        codes=frozenset({"clock.drift"}),
    ),
    Case(
        "a drift that changes",
        (ClockDrift(at_s=0.0, drift_ppm=20.0), ClockDrift(at_s=400.0, drift_ppm=60.0)),
        expected=(("drift_ppm", 20.0, 0.0), ("drift_change_ppm", 60.0, 0.0), ("break_s", 400.0, 0.0)),
        codes=frozenset({"clock.relation_rate"}),
    ),
    Case(
        "GPS time told as UTC",
        told=off_by(18.0),
        expected=(("offset_s", 18.0 - LATENCY_S, 0.002), ("mistake_s", 18.0 - LATENCY_S, 0.002)),
        codes=frozenset({"clock.leap_seconds"}),
    ),
    Case(
        "leap seconds that arrive late",
        told=off_by(18.0, before_s=250.0),
        expected=(("relation_step_s", -18.0, 0.0), ("break_s", 250.0, 0.0), ("mistake_s", -18.0, 0.002)),
        codes=frozenset({"clock.leap_seconds", "clock.relation_step"}),
    ),
    Case(
        "a rolled-over week",
        told=off_by(-ROLLOVER_S),
        expected=(("mistake_s", -ROLLOVER_S - LATENCY_S, 0.002), ("drift_ppm", 0.0, 0.0)),
        codes=frozenset({"clock.week_number"}),
    ),
    Case(
        "a week that is put right",
        told=off_by(-ROLLOVER_S, before_s=350.0),
        expected=(("relation_step_s", ROLLOVER_S, 0.002), ("break_s", 350.0, 0.0), ("segments", 2, 0.1)),
        codes=frozenset({"clock.week_number", "clock.relation_step"}),
    ),
    Case(
        "local time told as UTC",
        told=off_by(10_800.0),
        expected=(("mistake_s", 10_800.0 - LATENCY_S, 0.002),),
        codes=frozenset({"clock.time_zone"}),
    ),
    Case(
        "a start at 1970, never set",
        start_utc="1970-01-01T00:00:00Z",
        expected=(("zero_s", UTC_NS / NS_PER_S - LATENCY_S, 0.002),),
        codes=frozenset({"clock.unset", "clock.no_utc"}),
        is_absolute=False,
        start="unset",
    ),
    Case(
        "a start at the zero of power-up",
        (ClockDrift(at_s=0.0, drift_ppm=50.0),),
        start_utc="",
        expected=(("drift_ppm", 50.0, 0.0), ("first_s", 0.0, 0.1)),
        codes=frozenset({"clock.no_utc"}),
        is_absolute=False,
        start="own_zero",
    ),
)


def logged(case: Case) -> Flight:
    """The damaged flight with what GNSS told, late and unevenly, and a counter of records."""
    gnss = flight()["gnss"]
    rng = np.random.default_rng(SEED)
    late_ns = np.rint((LATENCY_S + JITTER_S * rng.standard_normal(len(gnss))) * NS_PER_S).astype(np.int64)
    told_s = case.told(gnss.time_ns) // 1_000_000 / 1e3 - np.round(late_ns / NS_PER_S, 3)
    columns = {"gnss_time_utc_s": Column(told_s), "counter": Column(np.arange(len(gnss), dtype=np.float64))}
    tables = {"gnss": gnss, "raw.recorder": replace(gnss, topic="raw.recorder", columns=columns)}
    metadata = {"start_utc": case.start_utc} if case.start_utc else {}
    return apply_faults(replace(flight(), tables=tables, metadata=metadata), case.faults)


def found_in(case: Case, folder: Path) -> Survey:
    path = folder / "a.csv"
    write_flat_csv(path, logged(case), resolution={"raw.recorder.gnss_time_utc_s": 1e-3, "raw.recorder.counter": 1.0})
    return survey(registry.read(path))


def quantities(found: Survey) -> dict[str, tuple[float, float]]:
    """What was found: value and the standard error that is told with it, 0 without."""
    (relation,) = found.clock.relations
    first, last = relation.segments[0], relation.segments[-1]
    told = {
        "segments": (len(relation.segments), 0.0),
        "offset_s": (last.offset_ns / NS_PER_S, 0.0),
        "zero_s": (last.offset_ns / NS_PER_S, 0.0),
        "first_s": (found.clock.first_device_ns / NS_PER_S, 0.0),
        "lost": (sum(one.lost for topic in found.ledger.topics for one in topic.sequences), 0.0),
    }
    if first.drift_ppm is not None and first.drift_sigma_ppm is not None:
        told["drift_ppm"] = first.drift_ppm, first.drift_sigma_ppm
    for step in found.clock.steps:
        told["step_s"] = step.set_s, 0.0
    for one in relation.breaks:
        told["break_s"] = (one.time_ns - found.ledger.start_ns) / NS_PER_S, one.time_sigma_s
        told["relation_step_s"] = one.step_s, one.step_sigma_s
        if one.drift_change_ppm is not None and last.drift_sigma_ppm is not None:
            told["drift_change_ppm"] = one.drift_change_ppm, float(np.hypot(told["drift_ppm"][1], last.drift_sigma_ppm))
    for mistake in relation.mistakes:
        told["mistake_s"] = mistake.size_s, 0.0
    return told


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_each_error_is_found_and_has_its_size(case: Case, tmp_path: Path) -> None:
    found = found_in(case, tmp_path)
    told = quantities(found)
    assert (found.clock.is_absolute, found.clock.start) == (case.is_absolute, case.start)
    for name, truth, tolerance in case.expected:
        value, sigma = told[name]
        assert abs(value - truth) <= (tolerance or SIGMAS * sigma), (name, value, truth, sigma)
    codes = {one.code for one in ledger_findings(found.ledger) if one.code.startswith(("clock.", "data."))}
    assert codes == case.codes, codes
    if "drift_ppm" in told:
        assert told["drift_ppm"][1] < 5.0  # a drift of 50 ppm would not be seen with a much larger one


@pytest.mark.parametrize("name", ["an epoch jump of 53 years", "a drift that changes", "a rolled-over week"])
def test_check_the_mcap_and_the_schema_tell_the_same(name: str, tmp_path: Path) -> None:
    case = next(case for case in CASES if case.name == name)
    told = to_json_exactly(found_in(case, tmp_path).clock.document())
    schema = json.loads((Path(__file__).parents[2] / "schemas/summary.schema.json").read_text(encoding="utf-8"))
    strict = {**schema["$defs"]["clock"], "additionalProperties": False, "$defs": schema["$defs"]}
    jsonschema.Draft202012Validator(strict).validate(told)
    assert set(told) == set(strict["properties"])
    convert_many([tmp_path / "a.csv"], tmp_path / "a.mcap")
    for log in ("a.csv", "a.mcap"):
        (checked,) = check_many([tmp_path / log], Configuration())
        assert to_json_exactly(checked.clock) == told
        text = text_of(checked)
        assert all(one["drift"] in text for relation in told["relations"] for one in relation["segments"])
        assert all(one["text"] in text for relation in told["relations"] for one in relation["mistakes"])
        assert all(f"{step['set_s']:+.3f}" in text for step in told["steps"])


def test_corrected_time_is_not_changed_by_the_drift(tmp_path: Path) -> None:
    case = next(case for case in CASES if case.name == "a drift of 50 ppm")
    gnss = found_in(case, tmp_path).ledger["gnss"]
    assert gnss.span_s == pytest.approx((SECONDS - PERIOD_S) * (1 + 50e-6), abs=PERIOD_S / 2 + 0.06)


def as_ulog(path: Path, device_us: Int64Array, utc_ns: Int64Array) -> Path:
    log = UlogWriter(start_us=int(device_us[0])).flags().format(GPS).subscribe(0, "vehicle_gps_position")
    for time_us, utc in zip(device_us.tolist(), utc_ns.tolist(), strict=True):
        log.row(0, GPS_CODE, time_us, utc // 1000, 0, 0, 0, 0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3, 1, 12)
    path.write_bytes(bytes(log.data))
    return path


def as_dataflash(path: Path, device_us: Int64Array, utc_ns: Int64Array) -> Path:
    log = DataFlash()
    log.define(8, "GPS", "QBIHBcLLefff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ")
    epoch_ns = iso_to_utc_ns("1980-01-06T00:00:00Z")[0]
    leap_ns = 18 * NS_PER_S
    for time_us, utc in zip(device_us.tolist(), utc_ns.tolist(), strict=True):
        week, rest_ns = divmod(utc - epoch_ns + leap_ns, 604_800 * NS_PER_S)
        log.write("GPS", time_us, 3, rest_ns // 1_000_000, week, 12, 100, 0, 0, 0, 0.0, 0.0, 0.0)
    path.write_bytes(log.content)
    return path


@pytest.mark.parametrize(("write", "name"), [(as_ulog, "a.ulg"), (as_dataflash, "a.BIN")])
@pytest.mark.parametrize("drift_ppm", [50.0, -400.0])
@pytest.mark.parametrize("weeks", [0, -1024])
def test_autopilots_drift_and_week(
    write: Callable[..., Path], name: str, drift_ppm: float, weeks: int, tmp_path: Path
) -> None:
    rng = np.random.default_rng(SEED)
    true_s = np.arange(0.0, 600.0, 0.2)
    late_s = LATENCY_S + 0.02 * rng.exponential(1.0, len(true_s))
    device_us = np.rint((20.0 + (true_s + late_s) * (1.0 + drift_ppm * 1e-6)) * 1e6).astype(np.int64)
    utc_ns = UTC_NS + np.rint(true_s * 1e3).astype(np.int64) * 1_000_000 + weeks * 604_800 * NS_PER_S
    found = survey(registry.read(write(tmp_path / name, device_us, utc_ns)))
    (relation,) = found.clock.relations
    (segment,) = relation.segments
    assert segment.drift_ppm is not None and segment.drift_sigma_ppm is not None and segment.drift_sigma_ppm < 5.0
    assert abs(segment.drift_ppm - drift_ppm) < SIGMAS * segment.drift_sigma_ppm
    codes = {one.code for one in ledger_findings(found.ledger) if one.code.startswith("clock.")}
    codes -= {"clock.missing_times"}  # definitions have none
    assert codes == ({"clock.drift"} if abs(drift_ppm) > 100 else set()) | ({"clock.week_number"} if weeks else set())


def test_the_report_has_the_clocks_in_tables(tmp_path: Path) -> None:
    case = next(case for case in CASES if case.name == "a backward step of 5 s")
    parts = quality(example(None, clock=found_in(case, tmp_path).clock.document())).parts
    grids = {part.title: part.rows for part in parts if isinstance(part, Grid)}
    (step,), (relation,) = grids["Steps of the recorder clock"], grids["Recorder clock against other clocks"]
    assert step[2] == "−5.000" and relation[0] == "GNSS · raw.recorder.gnss_time_utc_s"
    assert str(relation[4]).endswith("ppm") and "±" in str(relation[4])
    facts = [part for part in parts if isinstance(part, Facts)]
    assert not [pair for part in facts for pair in part.pairs if "relations" in pair[0] or "steps" in pair[0]]
