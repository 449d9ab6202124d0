"""Heights about a touchdown, and the ground of the roll-out carried back under the flare.

The runway may rise: a height is judged against the line through the roll-out, whose slope and unevenness are part of
sigma.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.signals import topics_of_kind
from groundstation.systems.landing.witnesses import rate_of
from groundstation.tables.lift_off import SLOPE_SIGMA
from groundstation.tables.sources import sources_of_kind

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

HEIGHT_CORRELATION_S = 1.0  # errors of neighbouring heights are one
UNEVEN = 0.008  # change of slope beyond the roll-out that the line was fitted to; two recorded runways show 0.01
ROLLS_S, SETTLED_S = 20.0, 3.5  # of the roll-out that is used, from so long behind the touchdown
SLOWEST_SHARE = 0.3  # of the speed at the touchdown: then the aircraft leaves the runway
FASTEST_HZ = 10.0
Motion = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # times -> distance flown, ground speed


@dataclass(frozen=True)
class HeightKind:
    """Kind of height: least noise, and the error that changes as the nose is let down."""

    topic_kind: str
    field: str
    noise_m: float
    nose_m: float
    counts_from_ground: bool

    @property
    def uneven(self) -> float:
        """Unevenness of the ground that the height shows; one above the ground shows none."""
        return 0.0 if self.counts_from_ground else UNEVEN


KINDS = (
    HeightKind("radio_altimeter", "height_m", 0.2, 0.5, True),
    HeightKind("baro", "height_above_airfield_m", 0.3, 0.4, True),
    HeightKind("gnss", "altitude_msl_m", 0.15, 0.2, False),
    HeightKind("gnss", "altitude_ellipsoid_m", 0.15, 0.2, False),
    HeightKind("ins", "altitude_msl_m", 0.15, 0.2, False),
    HeightKind("ins", "altitude_ellipsoid_m", 0.15, 0.2, False),
)
PRESSURE = HeightKind("baro", "pressure_altitude_m", 1.0, 1.5, False)  # ground effect moves it by metres
SPEED_NOISE_MPS = 0.12  # of a vertical speed
LATE_S, LATE_SIGMA_S = 0.3, 0.25  # a satellite receiver smooths, and its answer comes later


@dataclass(frozen=True, eq=False)
class Heights:
    """Heights of one source about a touchdown, arrays of shape (n,).

    The vertical speed is NaN where it is not logged; ``along_m`` is the distance flown at its times, ``speed_mps`` the
    ground speed.
    """

    kind: HeightKind
    topic: str
    time_s: FloatArray
    height_m: FloatArray
    down_mps: FloatArray
    along_m: FloatArray
    speed_mps: FloatArray

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return rate_of(self.time_s)


@dataclass(frozen=True, eq=False)
class Ground:
    """Line through the heights of a roll-out.

    ``level_m`` is at the start of the fitted part, ``start_m`` along the path; ``slope`` in metres per metre.
    """

    start_m: float
    level_m: float
    slope: float
    covariance: FloatArray
    noise_m: float
    down_offset_mps: float

    def height_m(self, along_m: FloatArray) -> FloatArray:
        """Height of the ground, shape as ``along_m``."""
        return np.asarray(self.level_m + self.slope * (along_m - self.start_m))

    def sigma_m(self, along_m: FloatArray, kind: HeightKind) -> FloatArray:
        """Sigma of that height."""
        back = along_m - self.start_m
        c = self.covariance
        variance = c[0, 0] + 2.0 * c[0, 1] * back + c[1, 1] * back**2
        return np.asarray(
            np.sqrt(variance + (kind.uneven * np.clip(-back, 0.0, None)) ** 2 + (kind.nose_m * (back < 0.0)) ** 2)
        )

    @property
    def slope_sigma(self) -> float:
        """Sigma of the slope."""
        return float(np.sqrt(self.covariance[1, 1]))


def heights_of(flight: "Flight", motion: Motion, first_s: float, last_s: float) -> tuple[Heights, ...]:
    """Return the heights of every kind within a stretch.

    Instances of a radio altimeter are taken together. A pressure altitude counts only where there is nothing else, a
    height above the airfield only without a radio one, from which recorders derive it.
    """
    found: list[Heights] = []
    for kind in KINDS:
        if any(one.kind.topic_kind == kind.topic_kind for one in found):
            continue
        if kind.field == "height_above_airfield_m" and found:
            continue
        known = _known(flight, motion, kind, first_s, last_s)
        if known is not None:
            found.append(known)
    if not found:
        known = _known(flight, motion, PRESSURE, first_s, last_s)
        found += [known] if known is not None else []
    return tuple(found)


def _known(flight: "Flight", motion: Motion, kind: HeightKind, first_s: float, last_s: float) -> Heights | None:
    is_radio = kind.topic_kind == "radio_altimeter"
    topics = topics_of_kind(kind.topic_kind, flight.topics()) if is_radio else sources_of_kind(flight, kind.topic_kind)
    named = [one for one in topics if flight[one].has(kind.field)]
    parts = []
    for topic in named if is_radio else named[:1]:
        table = flight[topic]
        time_s, height = flight.time_s(topic), table.values(kind.field)
        rows = (time_s >= first_s) & (time_s <= last_s) & np.isfinite(height)
        parts.append((time_s[rows], height[rows], table.values("velocity_down_mps")[rows]))
    if not parts or sum(len(one[0]) for one in parts) < 5:
        return None
    time_s, height, down = (np.concatenate(one) for one in zip(*parts, strict=True))
    time_s, first = np.unique(time_s, return_index=True)
    every = max(int(rate_of(time_s) / FASTEST_HZ), 1)
    kept = first[::every]
    topic = kind.topic_kind if is_radio and len(named) > 1 else named[0]
    return Heights(kind, topic, time_s[::every], height[kept], down[kept], *motion(time_s[::every]))


def ground_of(heights: Heights, touchdown_s: float) -> Ground | None:
    """Fit the ground to the roll-out; None where it has fewer than three samples.

    The slope has the prior of runways; noise is the scatter about the line, at least that of the kind.
    """
    along_m, speed_mps = heights.along_m, heights.speed_mps
    since = heights.time_s - touchdown_s
    at_touchdown = float(np.interp(touchdown_s, heights.time_s, speed_mps))
    slow = np.flatnonzero((since > SETTLED_S) & (speed_mps < SLOWEST_SHARE * at_touchdown))
    until = heights.time_s[slow[0]] if slow.size else np.inf
    rows = (since >= SETTLED_S) & (since <= ROLLS_S) & (heights.time_s <= until)
    if rows.sum() < 3:
        return None
    start = float(along_m[rows][0])
    x, y = along_m[rows] - start, heights.height_m[rows]
    design = np.stack([np.ones(len(x)), x], axis=-1)
    each = min(1.0, 1.0 / (heights.rate_hz * HEIGHT_CORRELATION_S)) if heights.rate_hz else 1.0
    kind, noise = heights.kind, heights.kind.noise_m
    prior = np.diag([0.0, (1.0 if not kind.counts_from_ground else 3.0) / SLOPE_SIGMA**2])
    for _ in range(2):
        information = design.T @ design * each / noise**2 + prior
        found = np.linalg.solve(information, design.T @ y * each / noise**2)
        scatter = float(np.sqrt(np.mean((y - design @ found) ** 2)))
        noise = max(kind.noise_m, scatter)
    down = heights.down_mps[rows]
    rising = down + found[1] * speed_mps[rows]
    offset = float(np.median(rising[np.isfinite(rising)])) if np.isfinite(rising).sum() >= 3 else np.nan
    return Ground(start, float(found[0]), float(found[1]), np.asarray(np.linalg.inv(information)), noise, offset)
