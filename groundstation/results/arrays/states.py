"""States of a vehicle along a flight: position, velocity and attitude with their sigmas."""

from dataclasses import fields
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray
from groundstation.results.arrays.typed import Arrays, Counts, Floats

LARGEST_STEP_S = 1.0  # between two states that is interpolated over
NOWHERE = -1  # segment of a time without a state
WRAPPED = {"longitude_deg": wrap_180, "roll_deg": wrap_180, "heading_deg": wrap_360, "true_heading_deg": wrap_360}


class Between(NamedTuple):
    """Places of times between neighbours of one segment.

    They are the two rows and the share of the second. The share is NaN where ``is_inside`` is false.
    """

    left: NDArray[np.intp]
    right: NDArray[np.intp]
    share: Floats
    is_inside: BoolArray

    def interpolated(self, values: Floats, name: str = "") -> Floats:
        """Return values (n, ...) at the times; an angle by its ``name`` the short way round."""
        weight = self.share[:, None] if values.ndim > 1 else self.share
        change = values[self.right] - values[self.left]
        wrap = WRAPPED.get(name)
        if wrap is None:
            return np.asarray(values[self.left] + weight * change)
        return np.asarray(wrap(values[self.left] + weight * wrap_180(change)))


def between(time_s: Floats, segment: Counts, at_s: Floats) -> Between:
    """Find the neighbours of times among states whose times increase.

    Examples
    --------
    >>> found = between(np.array([0.0, 0.5, 3.0]), np.array([0, 0, 1]), np.array([0.25, 0.5, 2.0]))
    >>> found.is_inside.tolist(), found.interpolated(np.array([1.0, 2.0, 9.0])).tolist()
    ([True, True, False], [1.5, 2.0, nan])
    """
    right = np.clip(np.searchsorted(time_s, at_s, side="left"), 0, max(len(time_s) - 1, 0))
    is_state = time_s[right] == at_s
    left = np.where(is_state, right, np.maximum(right - 1, 0))
    step_s = time_s[right] - time_s[left]
    is_within = (time_s[left] <= at_s) & (at_s <= time_s[right])
    inside = is_within & (segment[left] == segment[right]) & (step_s <= LARGEST_STEP_S)
    share = np.where(inside, (at_s - time_s[left]) / np.where(step_s > 0.0, step_s, 1.0), np.nan)
    return Between(left, right, share, inside)


class BodyStates(
    Arrays,
    figure="trajectory_states",
    digits={"time_s": 6, "*tude_deg": 9, "*_m": 4, "*_mps": 5, "*_deg": 4},
):
    """States of a body, every one that an estimate gives, in order of time.

    Altitudes are above the ellipsoid or above mean sea level, as the receiver of the log gives them. ``segment`` grows
    where states of two stretches must not be joined.
    """

    is_copied: ClassVar[bool] = False

    time_s: Floats
    segment: Counts
    latitude_deg: Floats
    longitude_deg: Floats
    altitude_ellipsoid_m: Floats | None = None
    altitude_msl_m: Floats | None = None
    velocity_north_mps: Floats
    velocity_east_mps: Floats
    velocity_down_mps: Floats
    roll_deg: Floats
    pitch_deg: Floats
    true_heading_deg: Floats
    position_north_sigma_m: Floats
    position_east_sigma_m: Floats
    vertical_sigma_m: Floats
    velocity_north_sigma_mps: Floats
    velocity_east_sigma_mps: Floats
    velocity_down_sigma_mps: Floats
    roll_sigma_deg: Floats
    pitch_sigma_deg: Floats
    true_heading_sigma_deg: Floats

    def at(self, time_s: Floats) -> "BodyStates":
        """Return states and sigmas at other times.

        They are interpolated between two of one segment that are at most a second apart; elsewhere they are NaN, and
        the segment is -1.
        """
        found = between(self.time_s, self.segment, time_s)
        made = {
            item.name: found.interpolated(values, item.name)
            for item in fields(self)
            if item.name not in ("time_s", "segment") and (values := getattr(self, item.name)) is not None
        }
        segment = np.where(found.is_inside, self.segment[found.left], NOWHERE)
        return BodyStates(time_s=np.asarray(time_s, dtype=np.float64), segment=segment, **made)

    def at_point(self, forward_m: float, right_m: float, down_m: float) -> "BodyStates":
        """Return the states of another point of the body, its sigmas those of this one."""
        attitude = np.column_stack([self.roll_deg, self.pitch_deg, self.true_heading_deg])
        arm = rotation_n_from_b(attitude) @ np.array([forward_m, right_m, down_m])
        moving = np.zeros_like(arm)
        for number in np.unique(self.segment):
            rows = np.flatnonzero(self.segment == number)
            if len(rows) > 1:
                moving[rows] = np.gradient(arm[rows], self.time_s[rows], axis=0)
        meridian, prime_vertical = curvature_radii_m(self.latitude_deg)
        height = self.altitude_ellipsoid_m if self.altitude_msl_m is None else self.altitude_msl_m
        height = np.zeros(len(self)) if height is None else height
        across = (prime_vertical + height) * np.cos(np.deg2rad(self.latitude_deg))
        kept = {item.name: getattr(self, item.name) for item in fields(self)}
        kept["latitude_deg"] = self.latitude_deg + np.rad2deg(arm[:, 0] / (meridian + height))
        kept["longitude_deg"] = wrap_180(self.longitude_deg + np.rad2deg(arm[:, 1] / across))
        for name in ("altitude_ellipsoid_m", "altitude_msl_m"):
            kept[name] = None if kept[name] is None else kept[name] - arm[:, 2]
        for axis, name in enumerate(("velocity_north_mps", "velocity_east_mps", "velocity_down_mps")):
            kept[name] = kept[name] + moving[:, axis]
        return BodyStates(**kept)
