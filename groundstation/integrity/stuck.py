"""Stuck values: a field keeps one value while another source shows that it must change.

Nothing is called stuck without a witness: a parked aircraft, a held slow channel and a constant are no damage.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import direction_of, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import METRES_PER_DEG
from groundstation.base.records import Int64Array, RecordBatch
from groundstation.base.signals import kind_of
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.limits import StuckLimits
from groundstation.integrity.stretches import Constancy, ConstantStretch, FloatArray, Sampler

FINE = 1.05  # samples that a value lasts, on average, where a channel is finer than its noise

_ALTITUDES = ("altitude_ellipsoid_m", "altitude_msl_m", "pressure_altitude_m")
_VELOCITIES = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps", "ground_speed_mps")
_HEADINGS = ("true_heading_deg", "magnetic_heading_deg", "track_deg")
_POSITIONS = ("latitude_deg", "longitude_deg")
_NOISY = (
    *(f"{quantity}_{axis}_{unit}" for quantity, unit in (("rate", "dps"), ("accel", "mps2")) for axis in "xyz"),
    *(
        f"delta_{quantity}_{axis}_{unit}"
        for quantity, unit in (("angle", "rad"), ("velocity", "mps"))
        for axis in "xyz"
    ),
    *(f"field_{axis}_nt" for axis in ("forward", "right", "down")),
)
_WITNESSES = frozenset((*_POSITIONS, *_ALTITUDES, *_VELOCITIES, *_HEADINGS))
_ATTITUDE = ("roll_deg", "pitch_deg")  # sampled beside the witnesses, which are no witnesses themselves
_TIME = "device_ns"
WATCHED = _WITNESSES | frozenset(_NOISY)
_KINDS = ("ins", "gnss", "baro", "magnetometer", "imu")


@dataclass(frozen=True)
class StuckPlace:
    """Stretch in which a field was stuck.

    It has its place, corrected time, length, samples, value, and the evidence.
    """

    record_index: int
    start_ns: int
    length_s: float
    samples: int
    value: float
    why: str


def watch(topic: str, name: str, limits: StuckLimits) -> Constancy | None:
    """Return what measures how a field stands still; None of one that is never found stuck."""
    if name not in WATCHED or kind_of(topic) not in _KINDS:
        return None
    return Constancy(limits.min_samples, has_steps=name not in _NOISY)


def _shared(one: ConstantStretch, other: ConstantStretch) -> ConstantStretch | None:
    """Return the records that two stretches share, with the value of the first; or None."""
    first = max(one.first, other.first, key=lambda place: place.record_index)
    last = min(one.last, other.last, key=lambda place: place.record_index)
    return one._replace(first=first, last=last) if first.record_index < last.record_index else None


class _Seen(NamedTuple):
    """One source of a quantity: topic, field, places and values."""

    topic: str
    name: str
    places: Int64Array
    values: FloatArray

    def within(self, stretch: ConstantStretch) -> FloatArray:
        """Return the finite values of the records inside a stretch."""
        low = np.searchsorted(self.places, stretch.first.record_index)
        high = np.searchsorted(self.places, stretch.last.record_index, side="right")
        values = self.values[low:high]
        return values[np.isfinite(values)]


class MotionSampler:
    """Motion of the aircraft by all sources, thinned."""

    def __init__(self) -> None:
        self._samplers: dict[str, Sampler] = {}

    def add(self, batch: RecordBatch, device_ns: Int64Array) -> None:
        """Sample a batch; ``device_ns`` are its times to go by."""
        if kind_of(batch.topic) not in _KINDS:
            return
        names = [name for name in batch.columns if name in _WITNESSES or name in _ATTITUDE]
        if not names:
            return
        sampler = self._samplers.setdefault(batch.topic, Sampler())
        rows = sampler.rows(len(batch))
        columns = {}
        for name in names:
            column = batch.columns[name]
            values = column.values[rows].astype(np.float64)
            columns[name] = values if column.present is None else np.where(column.present[rows], values, np.nan)
        columns[_TIME] = np.array(device_ns[rows], dtype=np.int64)
        sampler.put(np.array(batch.record_index[rows]), columns)

    def samples(self) -> Iterator[tuple[str, Int64Array, Int64Array, dict[str, FloatArray]]]:
        """Yield places, device times and values topic by topic, in the order of the log."""
        for topic, sampler in sorted(self._samplers.items()):
            index, columns = sampler.all()
            yield topic, index, columns[_TIME], {name: one for name, one in columns.items() if name != _TIME}

    def sources(self) -> list[_Seen]:
        """Return every source of every quantity.

        Speed and track are made from velocities where they are not logged.
        """
        found = []
        for topic, sampler in sorted(self._samplers.items()):
            index, columns = sampler.all()
            order = np.argsort(index, kind="stable")
            index, columns = index[order], {name: one[order] for name, one in columns.items() if name in _WITNESSES}
            if {"velocity_north_mps", "velocity_east_mps"} <= columns.keys():
                north, east = columns["velocity_north_mps"], columns["velocity_east_mps"]
                with np.errstate(over="ignore"):
                    columns.setdefault("ground_speed_mps", np.hypot(north, east))
                known = np.isfinite(north) & np.isfinite(east)
                columns.setdefault("track_deg", np.where(known, direction_of(north, east), np.nan))
            found += [_Seen(topic, name, index, values) for name, values in columns.items()]
        return found


class Judge:
    """Judge that tells stuck stretches from innocent ones."""

    def __init__(self, motion: MotionSampler, clock: ClockModel, limits: StuckLimits) -> None:
        self._sources = motion.sources()
        self._clock, self._limits = clock, limits

    def stuck(self, topic: str, fields: dict[str, Constancy]) -> dict[str, tuple[StuckPlace, ...]]:
        """Return the stuck stretches of a topic, by field."""
        long = {name: list(self._long(name, constancy)) for name, constancy in fields.items()}
        found = {}
        for name, stretches in long.items():
            told = [(one, self._why(topic, name, one, fields, long)) for one in stretches]
            stuck = tuple(self._told(one, why) for one, why in told if why)
            if stuck:
                found[name] = stuck
        return found

    def _long(self, name: str, constancy: Constancy) -> Iterator[ConstantStretch]:
        """Return the stretches that last, of a field that is not constant through the whole log."""
        times = self._limits.noise_times_usual if name in _NOISY else self._limits.times_usual
        for stretch in constancy.stretches(times) if constancy.changes else ():
            by_device_ns = stretch.last.device_ns - stretch.first.device_ns  # the clock is asked where it matters
            is_short = 0 <= by_device_ns < self._limits.min_s * NS_PER_S
            if not is_short and self._seconds(stretch) >= self._limits.min_s:
                yield stretch

    def _seconds(self, stretch: ConstantStretch) -> float:
        return (stretch.last.time_ns(self._clock) - stretch.first.time_ns(self._clock)) / NS_PER_S

    def _told(self, stretch: ConstantStretch, why: str) -> StuckPlace:
        start_ns = stretch.first.time_ns(self._clock)
        index = stretch.first.record_index
        return StuckPlace(index, start_ns, self._seconds(stretch), stretch.samples, stretch.value, why)

    def _why(
        self,
        topic: str,
        name: str,
        stretch: ConstantStretch,
        fields: dict[str, Constancy],
        long: dict[str, list[ConstantStretch]],
    ) -> str:
        """Return the evidence that the value should have changed; empty when there is none."""
        constancy = fields[name]
        if name in _NOISY:
            return self._why_noisy(stretch, constancy.usual_samples(without=stretch))
        least = self._limits.times_resolution * constancy.resolution
        if name in _HEADINGS:
            return self._why_heading(topic, name, stretch, least)
        if name in _VELOCITIES:
            return self._why_elsewhere(topic, (name,), stretch, max(self._limits.velocity_mps, least), "m/s")
        if name in _ALTITUDES:
            return self._why_elsewhere(topic, _ALTITUDES, stretch, max(self._limits.position_m, least), "m")
        scale = METRES_PER_DEG * self._shrinks(name, stretch)
        enough_m = max(self._limits.position_m, least * scale)
        why = self._why_elsewhere(topic, (name,), stretch, enough_m, "m", scale)
        return why or self._why_position(topic, name, stretch, fields, long)

    def _shrinks(self, name: str, stretch: ConstantStretch) -> float:
        """Return the length of a degree of longitude over that of one of latitude.

        It is 1 for the latitude itself.
        """
        if name == "latitude_deg":
            return 1.0
        seen = [one.within(stretch) for one in self._sources if one.name == "latitude_deg"]
        latitudes = [values for values in seen if len(values)]
        return float(np.cos(np.deg2rad(latitudes[0][0]))) if latitudes else 1.0

    def _why_elsewhere(
        self, topic: str, names: tuple[str, ...], stretch: ConstantStretch, enough: float, unit: str, scale: float = 1.0
    ) -> str:
        """Return the evidence that the same quantity of another topic moves."""
        for seen in self._sources:
            if seen.name not in names or seen.topic == topic:
                continue
            values = seen.within(stretch)
            moved = float(np.ptp(values)) * scale if len(values) > 1 else 0.0
            if moved > enough:
                return f"{seen.topic}.{seen.name} moves by {moved:.0f} {unit} meanwhile"
        return ""

    def _slowest(self, topic: str, stretch: ConstantStretch) -> tuple[str, float, float] | None:
        """Return source, least and mean speed during a stretch; of one topic where it is named."""
        for seen in self._sources:
            if seen.name == "ground_speed_mps" and topic in ("", seen.topic):
                values = seen.within(stretch)
                with np.errstate(over="ignore"):  # values that no motion has tell of none
                    mean = float(values.mean()) if len(values) > 1 else np.inf
                if np.isfinite(mean):
                    return seen.topic, float(values.min()), mean
        return None

    def _why_position(
        self,
        topic: str,
        name: str,
        stretch: ConstantStretch,
        fields: dict[str, Constancy],
        long: dict[str, list[ConstantStretch]],
    ) -> str:
        """Return the evidence that the aircraft moves while both coordinates stand still.

        Only the time counts in which both do, and a way of several of the steps that the two are written in.
        """
        other = "longitude_deg" if name == "latitude_deg" else "latitude_deg"
        steps_m = (
            METRES_PER_DEG * self._shrinks(one, stretch) * fields[one].resolution
            for one in (name, other)
            if one in fields
        )
        enough_m = max(self._limits.position_m, self._limits.times_resolution * math.hypot(*steps_m))
        for both in (shared for one in long.get(other, ()) if (shared := _shared(stretch, one)) is not None):
            speed = self._slowest(topic, both) or self._slowest("", both)
            moved_m = 0.0 if speed is None else speed[2] * self._seconds(both)
            if speed is not None and speed[1] > self._limits.moving_mps and moved_m > enough_m:
                return f"the speed of {speed[0]} covers {moved_m:.0f} m while both coordinates stand still"
        return ""

    def _why_heading(self, topic: str, name: str, stretch: ConstantStretch, least: float) -> str:
        """Return the evidence that another heading or track turns.

        A track counts only where the aircraft moves.
        """
        moving = self._limits.moving_mps
        own = self._slowest(topic, stretch)
        if name == "track_deg" and (own is None or own[1] <= moving):
            return ""
        for seen in self._sources:
            if seen.name not in _HEADINGS or (seen.topic, seen.name) == (topic, name):
                continue
            speed = self._slowest(seen.topic, stretch)
            if seen.name == "track_deg" and (speed is None or speed[1] <= moving):
                continue
            values = seen.within(stretch)
            if len(values) < 2:
                continue
            turned = wrap_180(values - values[0])
            moved = float(turned.max() - turned.min())
            if moved > max(self._limits.heading_deg, least):
                return f"{seen.topic}.{seen.name} turns by {moved:.0f} deg meanwhile"
        return ""

    def _why_noisy(self, stretch: ConstantStretch, usual: float) -> str:
        """Return the evidence against a noisy value that stands still.

        The aircraft moves, or nobody knows whether it does.
        """
        speed = self._slowest("", stretch)
        if speed is None:
            return f"a value lasts {usual:.2f} samples otherwise" if usual <= FINE else ""
        if speed[1] <= self._limits.moving_mps:
            return ""
        return f"{speed[0]} shows at least {speed[1]:.0f} m/s, and a value lasts {usual:.1f} samples otherwise"
