"""Position against velocity of a receiver: jumps, difference, delay between the two."""

from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray
from groundstation.systems.gnss.answer import PositionJump, VelocityAgainstPosition
from groundstation.systems.gnss.series import ReceiverRows
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.gnss.spells import known
from groundstation.tables.motion import runs

LEAST_STEPS = 10
MOST_JUMPS = 20  # that the answer lists, the largest; all are counted
LASTING_S = 10.0  # over which a velocity and places that tell different motions part
MAD_TO_SIGMA = 1.4826
ALONG_ONLY = 0.2  # of its part along the motion: a smaller part across is a shift in time
FAST_MPS = 5.0  # slower, a step along the motion is as likely one of the place
ROBUST_SIGMAS = 5.0
ROUNDING = 1e-6  # m or m/s: a smaller difference is none
RARE = 0.1  # of all steps: jumps are fewer
BY_PHASE = ("rtk_fixed", "rtk_float", "ppp")


class Steps(NamedTuple):
    """Steps of the position beyond those of the velocity, one a row; NaN where there is none.

    ``beyond_m`` has shape (n, 2), north and east, and belongs to the later row of a step. A velocity counts at its own
    time where its delay is known.
    """

    beyond_m: FloatArray
    answer: VelocityAgainstPosition | None
    jumps: tuple[PositionJump, ...]
    jumps_found: int


def steps_of(one: ReceiverRows, settings: GnssSettings) -> Steps:
    """Compare each step of the position with the mean velocity of its ends.

    What a delay of the velocity explains is taken off. Without velocities, with the step before it: then only jumps are
    found.
    """
    count = len(one.time_s)
    beyond = np.full((count, 2), np.nan)
    if count < LEAST_STEPS:
        return Steps(beyond, None, (), 0)
    later = np.arange(1, count)
    step_m = one.plan_m(later, one.latitude_deg[:-1], one.longitude_deg[:-1])
    step_s = np.diff(one.time_s)
    usable = ~one.is_gap & one.has_fix[1:] & one.has_fix[:-1] & np.isfinite(step_m).all(axis=1) & (step_s > 0.0)
    velocity = 0.5 * (one.velocity_mps[1:, :2] + one.velocity_mps[:-1, :2])
    has_velocity = usable & np.isfinite(velocity).all(axis=1)
    answer = None
    if np.count_nonzero(has_velocity) >= LEAST_STEPS:
        usable = has_velocity
        beyond[1:][usable] = (step_m - velocity * step_s[:, None])[usable]
        answer = _motion(one, beyond[1:], step_s, usable, settings)
        late_m = (answer.lag_s or 0.0) * np.diff(one.velocity_mps[:, :2], axis=0)  # a turn is no jump
        beyond[1:] -= late_m
    else:
        speed = np.where(usable[:, None], step_m / np.where(step_s > 0.0, step_s, 1.0)[:, None], np.nan)
        expected = np.vstack([np.full((1, 2), np.nan), speed[:-1]]) * step_s[:, None]
        beyond[1:] = step_m - expected
    jumps, found = _jumps(one, beyond, step_s, settings)
    return Steps(beyond, answer, jumps, found)


def _motion(
    one: ReceiverRows, beyond_m: FloatArray, step_s: FloatArray, usable: BoolArray, settings: GnssSettings
) -> VelocityAgainstPosition:
    """Return the difference in velocity, and the delay that explains it by the accelerations.

    A velocity that is late by ``lag`` misses ``lag * acceleration``. Outliers, as jumps are, are told by what the delay
    leaves: a turn of a straight flight is none.
    """
    difference = beyond_m[usable] / step_s[usable, None]
    seconds = float(step_s[usable].sum())
    acceleration = (np.diff(one.velocity_mps[:, :2], axis=0) / step_s[:, None])[usable]
    left = np.linalg.norm(difference - _middle_slope(acceleration, difference) * acceleration, axis=1)
    kept = _is_usual(left, _coarse_m(one) / step_s[usable])
    rms = float(np.sqrt(np.mean(np.sum(difference[kept] ** 2, axis=1))))
    lag_s, sigma_s = slope(acceleration[kept].ravel(), difference[kept].ravel())
    is_known = np.isfinite(sigma_s) and sigma_s <= settings.lag_sigma_max_s
    left = difference[kept] - (lag_s if is_known else 0.0) * acceleration[kept]
    claimed = one.values("velocity_sigma_mps")
    claimed = claimed[np.isfinite(claimed)]
    return VelocityAgainstPosition(
        seconds,
        rms,
        float(np.sqrt(np.mean(np.sum(left**2, axis=1)))) if len(left) else rms,
        _lasting_mps(beyond_m, step_s, usable),
        float(np.median(claimed)) if claimed.size else None,
        lag_s if is_known else None,
        sigma_s if is_known else None,
    )


def _lasting_mps(beyond_m: FloatArray, step_s: FloatArray, usable: BoolArray) -> float | None:
    """Return the RMS of the difference in velocity as means over ten seconds.

    None without a stretch so long.

    White noise of the position, ``s`` in each of two axes, leaves ``2 s / LASTING_S`` of it whatever the rate of fixes,
    where from fix to fix it is ``2 s`` times the rate.
    """
    means = []
    for start, end in runs(usable):
        passed_s = np.concatenate([[0.0], np.cumsum(step_s[start:end])])
        moved_m = np.vstack([np.zeros((1, 2)), np.cumsum(beyond_m[start:end], axis=0)])
        rows = np.flatnonzero(np.diff(passed_s // LASTING_S, prepend=-1.0) > 0.0)  # first of every ten seconds
        if len(rows) > 1:
            means.append(np.diff(moved_m[rows], axis=0) / np.diff(passed_s[rows])[:, None])
    if not means:
        return None
    size = np.linalg.norm(np.vstack(means), axis=1)
    return float(np.sqrt(np.mean(size[_is_usual(size)] ** 2)))


def _is_usual(size: FloatArray, least: FloatArray | float = 0.0) -> BoolArray:
    """Tell which differences are no outliers, as jumps of the position are.

    None below ``least`` is.
    """
    return np.asarray(size <= np.maximum(least, max(ROBUST_SIGMAS * _usual(size), ROUNDING)))


def _usual(size: FloatArray) -> float:
    """Return the usual size of differences, as a sigma.

    Differences of nothing are left out: between rows of the same place, as a receiver writes it in coarse steps or
    holds it, they say nothing of the others. 0 where the others are so few that they may all be jumps.
    """
    beyond = size[size > ROUNDING]
    return MAD_TO_SIGMA * float(np.median(beyond)) if beyond.size > RARE * size.size else 0.0


def _coarse_m(one: ReceiverRows) -> float:
    """Return how far places may be off by the steps that they are logged in.

    Of latitude and longitude together; 0 where latitude changes so seldom that its smallest change may be a jump.
    """
    changes = np.count_nonzero(np.abs(np.diff(one.latitude_deg)) > 0.0)
    return float(np.sqrt(2.0)) * one.resolution_m if changes >= LEAST_STEPS else 0.0


def _middle_slope(x: FloatArray, y: FloatArray) -> float:
    """Return the slope through zero with the least sum of absolute differences.

    0 where x is 0 throughout. It is the weighted median of ``y / x``, which some jumps do not move.
    """
    x, y = (values[x.ravel() != 0.0] for values in (x.ravel(), y.ravel()))
    if not x.size:
        return 0.0
    order = np.argsort(y / x)
    weight = np.cumsum(np.abs(x[order]))
    return float((y / x)[order][np.searchsorted(weight, 0.5 * weight[-1])])


def slope(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return the slope of a line through zero, and its sigma.

    Four neighbours count as one value.

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 100)
    >>> [round(value, 6) for value in slope(x, 0.3 * x)]
    [0.3, 0.0]
    """
    power = float(np.sum(x * x))
    if len(x) < LEAST_STEPS or not power > 0.0:
        return float("nan"), float("nan")
    found = float(np.sum(x * y) / power)
    left = y - found * x
    return found, float(np.sqrt(4.0 * np.mean(left**2) * 1.0 / power))


def _jumps(
    one: ReceiverRows, beyond_m: FloatArray, step_s: FloatArray, settings: GnssSettings
) -> tuple[tuple[PositionJump, ...], int]:
    """Return the largest steps far beyond the usual difference, and how many there are.

    Places that are logged in steps may be off by one of them in latitude and in longitude.
    """
    size = np.maximum(_beyond_jitter(one, beyond_m, settings) - _coarse_m(one), 0.0)
    finite = np.isfinite(size)
    if np.count_nonzero(finite) < LEAST_STEPS:
        return (), 0
    usual = _usual(size[finite])
    precise = np.isin(one.state, BY_PHASE)
    precise[1:] &= precise[:-1]
    least_m = np.where(precise, settings.jump_min_rtk_m, settings.jump_min_m)
    is_jump = finite & (size > np.maximum(least_m, settings.jump_sigmas * usual))
    if np.isnan(one.velocity_mps[:, 0]).all():  # the step behind a jump shows it again, the other way
        is_jump[1:] &= ~is_jump[:-1]
    rows = np.flatnonzero(is_jump)
    largest = np.sort(rows[np.argsort(-size[rows], kind="stable")[:MOST_JUMPS]])
    return tuple(_jump(one, row, beyond_m[row], step_s[row - 1]) for row in largest.tolist()), len(rows)


def _beyond_jitter(one: ReceiverRows, beyond_m: FloatArray, settings: GnssSettings) -> FloatArray:
    """Return the size of each step without the part that a small error in time explains.

    That is along the motion.
    """
    size = np.hypot(beyond_m[:, 0], beyond_m[:, 1])
    speed = np.hypot(one.velocity_mps[:, 0], one.velocity_mps[:, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.abs(np.sum(beyond_m * one.velocity_mps[:, :2], axis=1)) / speed
        across = np.sqrt(np.maximum(size**2 - along**2, 0.0))
        less = np.hypot(across, np.maximum(along - settings.stamp_jitter_s * speed, 0.0))
    return np.where(np.isfinite(less), less, size)


def _jump(one: ReceiverRows, row: int, beyond_m: FloatArray, step_s: float) -> PositionJump:
    size_m, velocity = float(np.hypot(*beyond_m)), one.velocity_mps[row - 1, :2]
    speed = float(np.hypot(*velocity))
    along_m = shift_s = None
    if np.isfinite(speed) and speed > 0.0:
        along_m = float(beyond_m @ velocity / speed)
        across_m = float(np.sqrt(max(size_m**2 - along_m**2, 0.0)))
        if speed > FAST_MPS and across_m < ALONG_ONLY * abs(along_m):
            shift_s = along_m / speed
    climbed = one.up_m[row] - one.up_m[row - 1]
    vertical = 0.5 * (one.velocity_mps[row, 2] + one.velocity_mps[row - 1, 2]) * step_s
    return PositionJump(
        float(one.time_s[row]),
        size_m,
        along_m,
        known(climbed - vertical),
        str(one.state[row - 1]),
        str(one.state[row]),
        shift_s,
    )
