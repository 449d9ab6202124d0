"""Two logs of one flight on one clock: intervals hold the truth, steps are found, what cannot be placed is refused."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.clock import Clock, RelationEntry, SegmentEntry
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.systems.joining import NotOneFlightError
from groundstation.systems.several_logs.gnss_time import GnssStretch, GnssTime, gnss_time_of
from groundstation.systems.several_logs.relate import relate
from groundstation.systems.several_logs.relation import LogRelation, RelationStretch, TimedLog
from groundstation.tables.table import Flight
from tests.systems.several_logs.example import RECEIVER_TIME, UTC_NS, Twice, recorded_twice, retimed, with_gnss_time

FLIGHT, TAXI, OTHER = 1, 3, 2  # draws
LIVELY_S = 0.02  # of a flight with turns: largest error at its middle
LEAP_NS = 18 * NS_PER_S
GNSS_ONLY_S = 0.25  # half of the interval where messages may have come late
RATES_HZ, SEEDS, LEAST_COVERED = (10.0, 5.0, 1.0), range(30), 0.85


@pytest.fixture(scope="module")
def twice() -> Twice:
    return recorded_twice(FLIGHT, 5.0)


def in_utc(flight: Flight, shift_ns: int = 0) -> Flight:
    ((_topic, table),) = flight.tables.items()
    return replace(retimed(flight, table.time_ns + UTC_NS + shift_ns), has_utc=True)


def turned(flight: Flight) -> Flight:
    """The same flight with the world turned by 90 degrees: simulated flights begin on one taxiway."""
    ((topic, table),) = flight.tables.items()
    north, east = table.columns["velocity_north_mps"], table.columns["velocity_east_mps"]
    moved = {"velocity_north_mps": east, "velocity_east_mps": Column(-north.values, north.present)}
    return replace(flight, tables={topic: replace(table, columns={**table.columns, **moved})})


def cut(flight: Flight, low: float, high: float) -> Flight:
    ((topic, table),) = flight.tables.items()
    part = table.take(slice(int(low * len(table)), int(high * len(table))))
    return replace(flight, tables={topic: part}, start_ns=int(part.time_ns[0]))


def test_motion_alone_places_a_log_on_a_clock_of_its_own(twice: Twice) -> None:
    found = relate(TimedLog(twice.first), TimedLog(twice.other))
    error_s, half_s = twice.errors(found)
    assert found.method == "motion"
    assert (np.abs(error_s) <= half_s).all()
    assert abs(error_s[1]) <= LIVELY_S


def test_a_clock_that_was_set_many_times_has_as_many_stretches() -> None:
    stretches = tuple(RelationStretch(10.0 * n, 10.0 * n, float(n), 0.5 * n, 0.0, 0.0, "gnss_time") for n in range(100))
    found = LogRelation(0, 0, (replace(stretches[0], begin_s=-np.inf), *stretches[1:]))
    own_ns = np.array([5, 15, 995]) * NS_PER_S
    assert found.first_time_ns(own_ns).tolist() == [5 * NS_PER_S, 16 * NS_PER_S, 1094 * NS_PER_S]
    assert found.half_width95_s(own_ns) == pytest.approx(NORMAL_95 * np.array([0.0, 0.5, 49.5]))


def test_either_log_may_be_the_first(twice: Twice) -> None:
    there = relate(TimedLog(twice.first), TimedLog(twice.other))
    back = relate(TimedLog(twice.other), TimedLog(twice.first))
    round_trip_s = (back.first_time_ns(there.first_time_ns(twice.own_ns)) - twice.own_ns) / NS_PER_S
    assert np.max(np.abs(round_trip_s)) <= np.max(there.half_width95_s(twice.own_ns))


def test_gnss_time_and_motion_are_weighed(twice: Twice) -> None:
    both, first, other = with_gnss_time(twice, FLIGHT)
    found = relate(first, other)
    error_s, half_s = both.errors(found)
    assert found.method == "gnss_time_and_motion"
    assert (np.abs(error_s) <= half_s).all()
    assert np.max(half_s) < 0.03


def test_leap_seconds_in_one_log_are_named_and_the_motion_is_believed(twice: Twice) -> None:
    both, first, other = with_gnss_time(twice, FLIGHT)
    late = TimedLog(retimed(other.flight, both.own_ns + LEAP_NS), other.gnss_time)
    found = relate(first, late)
    assert found.method == "motion"
    assert "equal to the leap seconds" in found.remarks[0]
    assert abs(both.with_own(both.own_ns + LEAP_NS).errors(found)[0][1]) <= LIVELY_S


def test_a_clock_that_is_set_on_the_way_is_two_stretches(twice: Twice) -> None:
    half = len(twice.own_ns) // 2
    own_ns = twice.own_ns + np.where(np.arange(len(twice.own_ns)) >= half, 7 * NS_PER_S, 0)
    stepped = twice.with_own(own_ns)
    found = relate(TimedLog(stepped.first), TimedLog(stepped.other))
    error_s, half_s = stepped.errors(found)
    assert len(found.stretches) == 2
    assert (np.abs(error_s) <= half_s).all()
    assert "was set" in found.remarks[-1]


def test_logs_that_overlap_in_part_are_joined(twice: Twice) -> None:
    first, other = cut(twice.first, 0.0, 0.7), cut(twice.other, 0.4, 1.0)
    found = relate(TimedLog(first), TimedLog(other))
    part = slice(int(0.4 * len(twice.own_ns)), int(0.7 * len(twice.own_ns)))
    error_s = (found.first_time_ns(twice.own_ns[part]) - twice.true_ns[part]) / NS_PER_S
    assert (np.abs(error_s) <= found.half_width95_s(twice.own_ns[part])).all()


def test_logs_without_a_time_in_common_are_refused(twice: Twice) -> None:
    day_ns = 86_400 * NS_PER_S
    with pytest.raises(NotOneFlightError, match=r"a\.bin and b\.ubx: no time in common"):
        relate(TimedLog(in_utc(twice.first), RECEIVER_TIME), TimedLog(in_utc(twice.other, day_ns), RECEIVER_TIME))


def test_logs_of_two_flights_are_refused(twice: Twice) -> None:
    stranger = recorded_twice(OTHER, 5.0).other
    with pytest.raises(NotOneFlightError, match="the motions do not fit"):
        relate(TimedLog(twice.first), TimedLog(stranger))
    with pytest.raises(NotOneFlightError, match="not of one flight"):
        elsewhere = in_utc(turned(retimed(stranger, stranger["gnss"].time_ns - stranger.start_ns)))
        relate(TimedLog(in_utc(twice.first), RECEIVER_TIME), TimedLog(elsewhere, RECEIVER_TIME))


def test_standstill_is_placed_by_gnss_time_by_file_time_or_not_at_all(twice: Twice) -> None:
    stands = 18 * NS_PER_S
    first, other = (
        replace(flight, tables={name: table.take(table.time_ns < flight.start_ns + stands)})
        for flight in (twice.first, retimed(twice.other, twice.true_ns))
        for name, table in flight.tables.items()
    )
    with pytest.raises(NotOneFlightError, match="too little motion"):
        relate(TimedLog(first), TimedLog(other))
    by_file = relate(TimedLog(in_utc(first)), TimedLog(in_utc(other)))
    assert by_file.method == "file_time"
    assert np.isinf(by_file.half_width95_s(other["gnss"].time_ns)).all()
    told = GnssTime((GnssStretch(0, 0, 0.0, 0.002, 0.0, 0.0),), is_own=False)
    by_gnss = relate(TimedLog(in_utc(first), told), TimedLog(in_utc(other), RECEIVER_TIME))
    assert by_gnss.method == "gnss_time"
    assert 0.15 < by_gnss.half_width95_s(in_utc(other)["gnss"].time_ns)[0] < GNSS_ONLY_S


def test_gnss_time_is_read_from_the_clock_of_a_log() -> None:
    segment = SegmentEntry(
        drift="", drift_ppm=20.0, drift_sigma_ppm=1.0, length_s=100.0, offset="", offset_s=-2.5, offset_sigma_s=0.01,
        samples=100, start="2026-05-04T06:00:00.000Z",
    )  # fmt: skip
    told = RelationEntry(
        clock="gnss", reason="", residual_s=0.0, resolution_s=0.0, samples=9, segments=(segment,), source=""
    )
    found = gnss_time_of(Clock(is_absolute=True, relations=(told,)), "px4-ulog")
    assert found is not None
    assert not found.is_own
    assert found.stretches[0].offset_at(UTC_NS) == pytest.approx(-2.5 + 20e-6 * 50.0)
    assert gnss_time_of(Clock(is_absolute=True), "flat-csv") is None
    receiver = gnss_time_of(Clock(is_absolute=True), "receiver")
    assert receiver is not None and receiver.is_own


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", RATES_HZ)
@pytest.mark.parametrize("has_gnss_time", [False, True])
def test_intervals_hold_the_truth(rate_hz: float, has_gnss_time: bool) -> None:
    held = []
    for seed in SEEDS:
        drawn = recorded_twice(seed, rate_hz)
        first, other = TimedLog(drawn.first), TimedLog(drawn.other)
        if has_gnss_time:
            drawn, first, other = with_gnss_time(drawn, seed)
        error_s, half_s = drawn.errors(relate(first, other))
        held.append(np.abs(error_s) <= half_s)
    assert (np.mean(held, axis=0) >= LEAST_COVERED).all()
