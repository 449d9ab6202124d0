"""A flight recorded twice, by a recorder with an INS and by a receiver, each on a clock of its own."""

from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.systems.several_logs.gnss_time import GnssStretch, GnssTime
from groundstation.systems.several_logs.relation import LogRelation, TimedLog
from groundstation.tables.table import Flight
from tests.drawn_flights import motion, recorded

LARGEST_DRIFT, LARGEST_OFFSET_NS = 50e-6, 3_000_000_000_000
UTC_NS = iso_to_utc_ns("2026-05-04T06:00:00Z")[0]
RECEIVER_TIME = GnssTime((GnssStretch(0, 0, 0.0, 0.001, 0.0, 0.0),), is_own=True)


@dataclass(frozen=True)
class Twice:
    """Both logs, and of each sample of the second its own time and the true one on the clock of the first."""

    first: Flight
    other: Flight
    own_ns: Int64Array
    true_ns: Int64Array

    def errors(self, found: LogRelation) -> tuple[np.ndarray, np.ndarray]:
        """Errors at beginning, middle and end of the second log, and half of the 95 % intervals, seconds."""
        rows = np.array([0, len(self.own_ns) // 2, len(self.own_ns) - 1])
        error_s = (found.first_time_ns(self.own_ns[rows]) - self.true_ns[rows]) / NS_PER_S
        return error_s, found.half_width95_s(self.own_ns[rows])

    def with_own(self, own_ns: Int64Array) -> "Twice":
        """The same with other times in the second log."""
        return replace(self, other=retimed(self.other, own_ns), own_ns=own_ns)


def recorded_twice(seed: int, gnss_hz: float, ins_hz: float = 20.0) -> Twice:
    """A flight by draw ``seed``: offset and drift of the receiver's clock, errors of both, antenna."""
    rng = np.random.default_rng((91, seed))
    drift, offset_ns = rng.uniform(-LARGEST_DRIFT, LARGEST_DRIFT), int(rng.uniform(-1, 1) * LARGEST_OFFSET_NS)
    both = recorded(motion(seed % 16), seed, 0.0, gnss_hz, ins_hz)
    true_ns = both["gnss"].time_ns
    own_ns = true_ns[0] + np.rint((true_ns - true_ns[0]) * (1.0 + drift)).astype(np.int64) + offset_ns
    first = Flight({"ins": both["ins"]}, start_ns=int(both["ins"].time_ns[0]), source_name="a.bin")
    other = retimed(Flight({"gnss": both["gnss"]}, source_name="b.ubx"), own_ns)
    return Twice(first, other, own_ns, true_ns)


def retimed(flight: Flight, own_ns: Int64Array) -> Flight:
    """A flight of one topic with other times."""
    ((topic, table),) = flight.tables.items()
    return replace(flight, tables={topic: replace(table, time_ns=own_ns)}, start_ns=int(own_ns[0]))


def with_gnss_time(twice: Twice, seed: int) -> tuple[Twice, TimedLog, TimedLog]:
    """The same in UTC: the receiver's times are GNSS time, and messages tell the recorder what its clock is off by.

    The recorder drifts; messages come to it late by up to 0.15 s. It is its clock that the truth is on.
    """
    rng = np.random.default_rng((92, seed))
    drift, arrival_s = rng.uniform(-LARGEST_DRIFT, LARGEST_DRIFT), rng.uniform(0.0, 0.15)
    wrong_s = rng.uniform(-5.0, 5.0)  # the recorder's clock was set by hand
    table = twice.first["ins"]
    zero_ns, end_ns = int(table.time_ns[0]), int(table.time_ns[-1])

    def recorder_ns(true_ns: Int64Array) -> Int64Array:
        late_s = wrong_s + drift * (true_ns - zero_ns) / NS_PER_S
        return np.asarray(UTC_NS + true_ns + np.rint(late_s * NS_PER_S).astype(np.int64))

    first = replace(retimed(twice.first, recorder_ns(table.time_ns)), has_utc=True)
    other = replace(retimed(twice.other, UTC_NS + twice.true_ns), has_utc=True)
    middle_ns = (zero_ns + end_ns) // 2
    told_s = -(wrong_s + drift * (middle_ns - zero_ns) / NS_PER_S) - arrival_s + rng.normal(0.0, 0.002)
    stretch = GnssStretch(0, UTC_NS + middle_ns, told_s, 0.002, drift + rng.normal(0.0, 2e-6), 2e-6)
    both = Twice(first, other, UTC_NS + twice.true_ns, recorder_ns(twice.true_ns))
    return both, TimedLog(first, GnssTime((stretch,), is_own=False)), TimedLog(other, RECEIVER_TIME)
