"""Stuck values, counters, sporadic topics and spans of damage, each with the truth that was built in."""

import itertools
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.records import Column, Damage, Item, LogHeader, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.integrity import LedgerCounts, ledger_findings, survey
from groundstation.integrity.clock_steps import quantile
from groundstation.integrity.limits import thresholds_from
from groundstation.integrity.stretches import Constancy, Sampler
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import open_log
from tests.saved import load
from tests.test_formats_agree import as_dataflash, as_ulog

Fields = Mapping[str, NDArray[np.float64]]
RATE = 5.0
SECONDS = 120
TIME_S = np.arange(int(SECONDS * RATE)) / RATE
FROZEN = slice(200, 300)  # 40.0 s to 59.8 s
TWO_STEPS_S = 0.2  # of the INS of the simulated taxi: to the records around what was lost


def batches(topic: str, fields: Fields, time_s: NDArray[np.float64] = TIME_S, pieces: int = 7) -> list[Item]:
    """A topic in several batches, so that what lasts crosses their borders."""
    times = np.round(time_s * NS_PER_S).astype(np.int64)
    parts = np.array_split(np.arange(len(times)), pieces)
    return [
        RecordBatch(topic, part, Column(times[part]), {name: Column(values[part]) for name, values in fields.items()})
        for part in parts
        if len(part)
    ]


def flight(speed_mps: float = 60.0, turn_dps: float = 3.0) -> dict[str, NDArray[np.float64]]:
    """A circling flight, or a parked aircraft with speed 0 and no turn."""
    heading = (turn_dps * TIME_S) % 360.0
    north = speed_mps * np.cos(np.deg2rad(turn_dps * TIME_S))
    east = speed_mps * np.sin(np.deg2rad(turn_dps * TIME_S))
    return {
        "latitude_deg": 48.0 + np.cumsum(north) / RATE / 111_195.0,
        "longitude_deg": 2.0 + np.cumsum(east) / RATE / 75_000.0,
        "velocity_north_mps": north,
        "velocity_east_mps": east,
        "true_heading_deg": heading,
    }


def frozen_in(fields: Fields, *names: str, where: slice = FROZEN) -> dict[str, NDArray[np.float64]]:
    out = {name: np.array(values) for name, values in fields.items()}
    for name in names:
        out[name][where] = out[name][where.start]
    return out


def without(fields: Fields, *names: str) -> dict[str, NDArray[np.float64]]:
    return {name: values for name, values in fields.items() if name not in names}


def ledger_of(**topics: Fields) -> LedgerCounts:
    items: list[Item] = [LogHeader("t")]
    for topic, fields in topics.items():
        items += batches(topic, fields)
    return survey(items).ledger


def stuck_fields(ledger: LedgerCounts) -> set[str]:
    return {f"{topic.topic}.{field.name}" for topic in ledger.topics for field in topic.fields if field.stuck}


@pytest.mark.parametrize("name", ["true_heading_deg", "velocity_north_mps", "latitude_deg", "longitude_deg"])
def test_a_field_that_stands_still_while_another_source_moves_is_stuck(name: str) -> None:
    other = without(flight(), "true_heading_deg")
    ledger = ledger_of(ins=frozen_in(flight(), name), gnss=other)
    assert stuck_fields(ledger) == {f"ins.{name}"}
    (field,) = (field for field in ledger["ins"].fields if field.name == name)
    (one,) = field.stuck
    assert (one.record_index, one.start_ns, one.samples) == (200, 40 * NS_PER_S, 100)
    assert one.length_s == pytest.approx(19.8) and one.value == flight()[name][200]
    (finding,) = (finding for finding in ledger_findings(ledger) if finding.code == "values.stuck")
    assert finding.severity == "warn" and "gnss" in finding.text and "19.8 s (100 samples)" in finding.text


def test_a_position_that_stands_still_is_told_by_the_speed_of_its_own_topic() -> None:
    frozen = frozen_in(flight(turn_dps=0.1), "latitude_deg", "longitude_deg")
    assert stuck_fields(ledger_of(gnss=frozen)) == {"gnss.latitude_deg", "gnss.longitude_deg"}
    one_alone = frozen_in(flight(turn_dps=0.1), "latitude_deg")  # flying due east does that
    assert stuck_fields(ledger_of(gnss=one_alone)) == set()


COARSE_DEG = 180.0 / 2**17  # of airliner recorders: 153 m of latitude


def in_steps(fields: Fields, step_deg: float, between: float) -> dict[str, NDArray[np.float64]]:
    """Positions cut to steps; where one follows, a reader has interpolated a share ``between`` of it."""
    out = {name: np.array(values) for name, values in fields.items()}
    for name in ("latitude_deg", "longitude_deg"):
        held = np.floor(fields[name] / step_deg) * step_deg
        out[name] = held + between * np.append(np.diff(held), 0.0)
    return out


def slowing(slow_mps: float, track_deg: float) -> dict[str, NDArray[np.float64]]:
    """Straight on at 200 m/s for half of the time, then slow."""
    speed_mps = np.where(TIME_S < 0.5 * SECONDS, 200.0, slow_mps)
    ahead_m = np.cumsum(speed_mps) / RATE
    north, east = (ahead_m * turn(np.deg2rad(track_deg)) for turn in (np.cos, np.sin))
    return {
        "latitude_deg": 48.0 + north / 111_195.0,
        "longitude_deg": 2.0 + east / 74_400.0,
        "ground_speed_mps": speed_mps,
    }


@pytest.mark.parametrize("between", [0.0, 0.015, 0.5])
@pytest.mark.parametrize("track_deg", [0.0, 20.0, 45.0, 90.0, 230.0])
def test_positions_in_coarse_steps_are_stuck_only_where_no_step_comes(track_deg: float, between: float) -> None:
    taxi = in_steps(slowing(10.0, track_deg), COARSE_DEG, between)
    assert stuck_fields(ledger_of(ins=taxi)) == set(), "a step takes up to 15 s"
    fast = in_steps(slowing(60.0, track_deg), COARSE_DEG, between)
    assert stuck_fields(ledger_of(ins=fast)) == set()
    if track_deg % 90.0:  # a coordinate that is constant all along is none that stands still
        frozen = frozen_in(fast, "latitude_deg", "longitude_deg", where=slice(300, 550))
        assert stuck_fields(ledger_of(ins=frozen)) == {"ins.latitude_deg", "ins.longitude_deg"}, "for 3000 m"


def test_coordinates_that_stand_still_one_after_the_other_are_not_stuck() -> None:
    """Taxi to the east, then to the north: the latitude stands still, then the longitude, never both for long."""
    corner = 300
    ahead = np.cumsum(np.full(len(TIME_S), 12.0 / RATE))
    east_m, north_m = np.minimum(ahead, ahead[corner]), np.maximum(ahead - ahead[corner], 0.0)
    taxi = {
        "latitude_deg": 48.0 + north_m / 111_195.0,
        "longitude_deg": 2.0 + east_m / 74_400.0,
        "ground_speed_mps": np.full(len(TIME_S), 12.0),
    }
    overlapping = frozen_in(taxi, "longitude_deg", where=slice(corner - 15, corner))
    overlapping["longitude_deg"][corner:] = overlapping["longitude_deg"][corner - 1]
    assert stuck_fields(ledger_of(gnss=overlapping)) == set(), "both stand for 3 s, 36 m"


def test_a_speed_that_no_motion_has_tells_of_no_stuck_position() -> None:
    nonsense = frozen_in(flight(turn_dps=0.1), "latitude_deg", "longitude_deg")
    nonsense |= {"velocity_north_mps": np.full(len(TIME_S), 1e308), "velocity_east_mps": np.ones(len(TIME_S))}
    assert stuck_fields(ledger_of(gnss=nonsense)) == set()


def test_a_parked_aircraft_has_nothing_stuck() -> None:
    parked = flight(0.0, 0.0)
    rng = np.random.default_rng(5)
    noisy = {name: values + rng.normal(0.0, 1e-7, len(values)) for name, values in parked.items()}
    held = frozen_in(noisy, *noisy)
    noise_of_track = {**held, "track_deg": rng.uniform(0.0, 360.0, len(TIME_S))}
    assert stuck_fields(ledger_of(ins=held, gnss=noise_of_track)) == set()


def test_what_is_constant_through_the_log_is_not_stuck() -> None:
    constant = {**flight(), "true_heading_deg": np.full(len(TIME_S), 12.0)}
    assert stuck_fields(ledger_of(ins=constant, gnss=flight())) == set()


def test_a_slow_channel_that_is_held_is_not_stuck() -> None:
    held = {name: np.repeat(values[::50], 50) for name, values in flight().items()}  # new every 10 s
    assert stuck_fields(ledger_of(ins=held, gnss=flight())) == set()
    for values in held.values():
        values[25:50] += 1e-4  # a small step: the channel is fine, and slow all the same
    assert stuck_fields(ledger_of(ins=held, gnss=flight())) == set()


def test_a_coarse_field_is_not_stuck_between_its_steps() -> None:
    coarse = {**flight(turn_dps=0.5), "true_heading_deg": np.floor(flight(turn_dps=0.5)["true_heading_deg"] / 15) * 15}
    assert stuck_fields(ledger_of(ins=coarse, gnss=flight(turn_dps=0.5))) == set()


def test_a_coarse_field_is_not_stuck_when_the_turn_slows_down() -> None:
    turned = np.where(TIME_S < 60.0, 30.0 * TIME_S, 1800.0 + 0.7 * (TIME_S - 60.0))
    coarse, fine = np.floor(turned / 45.0) * 45.0 % 360.0, turned % 360.0
    assert (
        stuck_fields(ledger_of(**{"ins.1": {"true_heading_deg": coarse}, "ins.2": {"true_heading_deg": fine}})) == set()
    )


def test_a_rate_that_is_never_still_is_stuck_when_it_is() -> None:
    rate = np.random.default_rng(3).normal(0.0, 1.0, len(TIME_S))
    frozen = frozen_in({"rate_x_dps": rate}, "rate_x_dps")
    assert stuck_fields(ledger_of(ins=frozen)) == {"ins.rate_x_dps"}
    assert stuck_fields(ledger_of(ins=frozen, gnss=flight())) == {"ins.rate_x_dps"}
    assert stuck_fields(ledger_of(ins=frozen, gnss=flight(0.0, 0.0))) == set(), "the aircraft stands"
    assert stuck_fields(ledger_of(ins={"rate_x_dps": rate})) == set()


def test_absent_samples_and_nan_do_not_make_a_stretch_shorter() -> None:
    heading = frozen_in(flight(), "true_heading_deg")["true_heading_deg"]
    heading[250] = np.nan
    items = [LogHeader("t"), *batches("ins", {"true_heading_deg": heading}), *batches("gnss", flight())]
    assert stuck_fields(survey(items).ledger) == {"ins.true_heading_deg"}


@pytest.mark.parametrize("bits", [8, 16, 24, 32, 48])
def test_a_record_counter_tells_what_is_missing(bits: int) -> None:
    count = (np.arange(1000) + 2**bits - 300) % 2**bits
    keep = np.ones(1000, dtype=bool)
    keep[400:407] = keep[700] = False
    kind = {8: np.uint8, 16: np.uint16}.get(bits, np.uint64)
    items: list[Item] = [LogHeader("t")]
    for part in np.array_split(np.flatnonzero(keep), 5):
        times = Column(part.astype(np.int64) * 10**8)
        items.append(RecordBatch("raw.bus", part, times, {"counter": Column(count[part].astype(kind))}))
    ledger = survey(items).ledger
    (found,) = ledger["raw.bus"].sequences
    assert (found.kind, found.lost, found.resets) == ("records", 8, 0)
    assert found.places == ((40_700_000_000, 7), (70_100_000_000, 1))
    assert [finding.count for finding in ledger_findings(ledger) if finding.code == "data.sequence"] == [8]


def test_a_counter_of_something_else_or_one_that_is_set_is_no_loss() -> None:
    index = np.arange(100)
    times = Column(index * 10**8)
    decimated = RecordBatch("raw.a", index, times, {"counter": Column(index * 5)})
    held = RecordBatch("raw.b", index, times, {"counter": Column(np.zeros(100, dtype=np.int64))})
    again = RecordBatch("raw.c", index, times, {"counter": Column(np.r_[0:50, 0:50])})
    ledger = survey([LogHeader("t"), decimated, held, again]).ledger
    assert ledger["raw.a"].sequences == ledger["raw.b"].sequences == ()
    (found,) = ledger["raw.c"].sequences
    assert (found.lost, found.resets) == (0, 1)


def test_the_recorders_own_count_of_losses() -> None:
    index = np.arange(6)
    lost = Column(np.array([3, 3, 5, 5, 9, 9], dtype=np.uint32))
    ledger = survey([LogHeader("t"), RecordBatch("raw.DSF", index, Column(index * NS_PER_S), {"Dp": lost})]).ledger
    (found,) = ledger["raw.DSF"].sequences
    assert (found.kind, found.before, found.lost) == ("losses", 3, 6)
    assert found.places == ((2 * NS_PER_S, 2), (4 * NS_PER_S, 4))


def test_bursts_and_topics_that_are_written_on_an_event_have_no_rate() -> None:
    bursts = np.concatenate([start + np.arange(8) * 0.012 for start in (0.0, 9.0, 14.0, 40.0)])
    regular = np.r_[np.arange(0, 60, 0.1), np.arange(600, 660, 0.1)]  # one long gap is no burst
    pairs = np.sort(np.r_[np.arange(0, 60, 0.1), np.arange(0, 60, 0.1) + 0.001])
    every_second = np.arange(0.0, 60.0, 1.0)
    items: list[Item] = [LogHeader("t", has_counting_clock=True)]
    named = {"raw.acks": bursts, "raw.imu": regular, "raw.home_position": every_second, "raw.slow": every_second}
    for topic, times in {**named, "ins": pairs}.items():
        items += batches(topic, {}, times, pieces=1)
    ledger = survey(items).ledger
    rates = {topic: (ledger[topic].nominal_rate_hz, ledger[topic].coverage) for topic in (*named, "ins")}
    assert rates["raw.acks"] == rates["raw.home_position"] == (None, None)
    assert rates["raw.imu"][0] == pytest.approx(10.0) and rates["raw.imu"][1] == pytest.approx(0.1818, abs=1e-3)
    assert len(ledger["raw.imu"].gaps) == 1 and len(ledger["raw.acks"].gaps) == 0
    assert rates["ins"] == (None, None), "two records a cycle: the usual step is no period"
    assert rates["raw.slow"][0] == pytest.approx(1.0)
    assert ledger.completeness.keys() == {topic for topic, (rate, _) in rates.items() if rate is not None}


def test_samples_missing_one_by_one_lower_the_coverage() -> None:
    keep = np.random.default_rng(1).uniform(size=1000) > 0.3
    ledger = survey([LogHeader("t"), *batches("ins", {}, np.flatnonzero(keep) * 0.1)]).ledger
    assert ledger["ins"].nominal_rate_hz == pytest.approx(10.0)
    assert ledger["ins"].coverage == pytest.approx(keep.sum() / 1000, abs=0.005)


def test_lost_rows_lie_between_the_rows_around_them() -> None:
    index = np.r_[0:50, 60:100]
    ins = RecordBatch("ins", index, Column(index * NS_PER_S), {"roll_deg": Column(np.zeros(90))})
    items: list[Item] = [
        LogHeader("t"),
        ins,
        Damage("dropped_rows", "rows 50 to 59", 10, "rows with fewer cells"),
        Damage("unreadable_cells", "ins.roll_deg, rows 10 to 80", 2, "cells", "ins"),
        Damage("corrupt", "bytes 100 to 163", 64, "bytes that belong to no message, skipped"),
        Damage("truncated", "byte 900", 5, "bytes of a message cut by the end of the file"),
        Damage("comment_line", "row 7", 1, "comment lines", loses_data=False),
    ]
    found = survey(items).ledger.document()
    spans = [(one.cause, one.field, one.start_s, one.length_s, one.is_exact) for one in found.spans]
    assert spans == [
        ("unreadable_cells", "roll_deg", 9.0, 72.0, False),
        ("dropped_rows", "", 49.0, 11.0, True),
        ("truncated", "", 99.0, 0.0, True),
    ]
    assert (found.bytes_skipped, found.skipped_spans) == (69, ((100, 163, 64), (900, 904, 5)))
    assert found.truncated is not None and found.truncated.place == "byte 900"
    assert found.topics["ins"].losses == {"unreadable_cells": 2}


def test_skipped_bytes_lie_between_the_records_around_them() -> None:
    index = np.r_[0:50, 50:90]
    times = Column(np.r_[0:50, 60:100] * NS_PER_S)
    ins = RecordBatch("ins", index, times, {"roll_deg": Column(np.zeros(90))})
    what = "bytes that belong to no message, skipped"
    for between, expected in (
        ((49, 50), (49.0, 11.0)),
        ((10, 20), (10.0, 10.0)),
        ((-1, 0), (0.0, 0.0)),
        ((89, 90), (99.0, 0.0)),
    ):
        damage = Damage("corrupt", "bytes 100 to 163", 64, what, between_records=between)
        (span,) = survey([LogHeader("t"), ins, damage]).ledger.document().spans
        assert (span.cause, span.start_s, span.length_s, span.is_exact) == ("corrupt", *expected, False)


@pytest.mark.parametrize("write", [pytest.param(as_ulog, marks=pytest.mark.slow), as_dataflash])
def test_bytes_wiped_in_the_taxi_are_found_in_time_and_lean(tmp_path: Path, write: Callable[[Path], None]) -> None:
    """The span holds the times of all records that were lost and hardly more, and the answer says that it leans."""
    path = tmp_path / "log"
    write(path)
    whole, content = records_of(path), path.read_bytes()
    at = len(content) * 3 // 10  # on the way to the runway, while it rolls straight
    path.write_bytes(content[:at] + bytes(300) + content[at + 300 :])
    lost = [time_ns for _topic, time_ns in whole - records_of(path)]
    start_ns = min(time_ns for _topic, time_ns in whole)
    assert len(lost) > 5
    (outcome,) = run_many([path], tmp_path / "out", Configuration(), with_pdf=False)
    summary = load(Path(outcome.folder)).summary
    (span,) = (one for one in summary["ledger"]["spans"] if one["cause"] == "corrupt")
    first_s, last_s = (round((time_ns - start_ns) / NS_PER_S, 3) for time_ns in (min(lost), max(lost)))
    start_s, end_s = span["start_s"], round(span["start_s"] + span["length_s"], 3)
    assert first_s - TWO_STEPS_S <= start_s <= first_s <= last_s <= end_s <= last_s + TWO_STEPS_S
    (finding,) = (one for one in summary["findings"] if one["code"] == "heading.damaged_span")
    assert finding["severity"] == "warn" and "corrupt (somewhere from" in finding["text"]


def records_of(path: Path) -> set[tuple[str, int]]:
    """Topics and device times (nanoseconds) of the records of a log."""
    batches = [item for item in open_log(path).items() if isinstance(item, RecordBatch)]
    times = [(one.topic, one.device_time_ns) for one in batches if one.topic.startswith("raw.")]
    return {(topic, time_ns) for topic, column in times for time_ns in column.values[column.mask].tolist()}


def test_a_range_of_the_user_is_used() -> None:
    limits = thresholds_from({"version": 1, "ranges": {"gnss": {"velocity_north_mps": [-50.0, 50.0]}}})
    items = [LogHeader("t"), *batches("gnss", flight())]
    assert not any(field.out_of_range for field in survey(items).ledger["gnss"].fields)
    ledger = survey(items, thresholds=limits).ledger
    (field,) = (field for field in ledger["gnss"].fields if field.out_of_range)
    assert field.name == "velocity_north_mps" and field.out_of_range == int(
        np.count_nonzero(np.abs(flight()["velocity_north_mps"]) > 50.0)
    )
    assert ledger.document().thresholds.name == "user"


def test_a_sampler_keeps_a_bounded_part_evenly() -> None:
    sampler = Sampler(100)
    for start in range(0, 10_000, 137):
        index = np.arange(start, min(start + 137, 10_000))
        rows = sampler.rows(len(index))
        sampler.put(index[rows], {"x": index[rows].astype(float)})
    index, columns = sampler.all()
    assert 50 <= len(index) <= 100 and np.array_equal(index, columns["x"])
    assert index[0] == 0 and len(np.unique(np.diff(index))) == 1


def test_numbers_at_the_ends_of_a_float_give_no_warning() -> None:
    rng = np.random.default_rng(4)
    wild = np.array([1.7e308, -1.7e308, np.inf, -np.inf, np.nan, 5e-324, 0.0, 1.0])
    fields = {name: rng.choice(wild, len(TIME_S)) for name in flight()}
    ends = {name: np.where(np.arange(len(TIME_S)) % 2, 1.7e308, -1.7e308) for name in flight()}
    found = survey([LogHeader("test"), *batches("gnss", fields), *batches("ins", ends)])
    assert all("\n" not in finding.text for finding in ledger_findings(found.ledger))


@pytest.mark.parametrize("levels", [1, 2, 3, 40])
def test_stretches_are_those_of_a_walk_sample_by_sample(levels: int) -> None:
    """However the samples are cut into batches, and whichever rows of a batch they are."""
    rng = np.random.default_rng(levels)
    values = rng.integers(0, levels, 400).astype(float)
    values[100:130] = values[130]
    runs = [(value, len(list(same))) for value, same in itertools.groupby(values.tolist())]
    ends = np.cumsum([length for _value, length in runs])
    long = [(int(end) - n, n, value) for (value, n), end in zip(runs, ends, strict=True) if n >= 3]
    for cut in (400, 57, 1):
        found = Constancy(3)
        for first in range(0, 400, cut):
            part = values[first : first + cut]
            places = np.arange(2 * first, 2 * (first + len(part)))
            found.add(part, places, 10 * places, 2 * np.arange(len(part)))
        told = [(one.first.record_index // 2, one.samples, one.value) for one in found.stretches()]
        assert told == long and found.changes == len(runs) - 1


def test_quantiles_are_those_of_the_sorted_steps() -> None:
    rng = np.random.default_rng(1)
    for steps in (rng.integers(0, 10**9, 999), rng.integers(0, 3, 1000), np.full(7, 20_000_000), np.array([5])):
        ordered = np.sort(steps)
        for share in (0.0, 0.5, 0.8, 1.0):
            expected = np.interp(share * (len(steps) - 1), np.arange(len(steps)), ordered)
            assert quantile(steps, share) == pytest.approx(expected, rel=1e-12)
