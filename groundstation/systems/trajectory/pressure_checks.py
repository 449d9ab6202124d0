"""Check of barometric heights against those of GNSS: stuck, of another unit, with a jump."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import M_PER_FOOT
from groundstation.systems.trajectory.aid_settings import AidSettings
from groundstation.systems.trajectory.inputs import GnssFixes

FEWEST = 30  # means of a second beside GNSS
LONGEST_STEP_S = 5.0  # between two fixes
LEAST_RANGE_M, RANGE_SIGMAS = 5.0, 10.0  # of GNSS height for a scale to be judged
LOW_RANGE_M = 30.0  # noise of GNSS makes a scale seem smaller: such a one is judged above this range
AIR_SCALE = 0.05  # sigma of the scale of the standard atmosphere, in air that is warmer or colder
ALIKE_S = 60.0  # errors of both last so long
SIGMA_SCALE = 2.0
ROUNDS = 5
BESIDE_S = 10.0  # before and behind a jump
JUMP_SIGMAS = 6.0
GAUSSIAN_MAD = 1.4826
FEET_SHARE = 0.03


@dataclass(frozen=True)
class Beside:
    """Barometric heights that agree with GNSS, or why they do not.

    Parameters
    ----------
    time_s, height_m : ndarrays, shape (k,)
        Once a second; the level is that of GNSS at the median, the scale that of GNSS where it shows one.
    wrong : str
        Why it cannot be used; empty where it can.
    told : str
    """

    time_s: FloatArray
    height_m: FloatArray
    wrong: str = ""
    told: str = ""


def beside_gnss(
    time_s: FloatArray,
    value: FloatArray,
    raw_s: FloatArray,
    raw: FloatArray,
    gnss: GnssFixes,
    settings: AidSettings,
) -> Beside:
    """Hold medians of a second, and the readings that they are of, against GNSS."""
    known = np.isfinite(gnss.height_m)
    if known.sum() < 2 or len(time_s) < FEWEST:
        return Beside(time_s, value, "too few heights of it or of GNSS")
    fix_s = gnss.time_s[known]
    height = np.interp(time_s, fix_s, gnss.height_m[known], left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(fix_s, time_s), 1, len(fix_s) - 1)
    near = (fix_s[after] - fix_s[after - 1] <= LONGEST_STEP_S) & np.isfinite(height)
    if near.sum() < FEWEST:
        return Beside(time_s, value, "it has no time in common with heights of GNSS")
    sigma_m = float(np.nanmedian(gnss.position_sigma_m[known, 2]))
    if np.ptp(raw) == 0.0:
        return Beside(time_s, value, "it keeps one height")
    climb_m = max(settings.stuck_climb_m, 4.0 * sigma_m)
    stuck_s = stuck(raw_s, raw, (fix_s, gnss.height_m[known]), settings.stuck_s, climb_m)
    if stuck_s:
        return Beside(time_s, value, f"it keeps one height for {stuck_s:.0f} s while GNSS moves by {climb_m:.0f} m")
    scale, scale_sigma = scale_of(time_s[near], value[near], height[near], sigma_m)
    wrong = _wrong_scale(scale, scale_sigma, float(np.ptp(height[near])), settings)
    if wrong:
        return Beside(time_s, value, wrong)
    share = AIR_SCALE**2 / (AIR_SCALE**2 + scale_sigma**2) if np.isfinite(scale_sigma) else 0.0
    scale = 1.0 + (scale - 1.0) * share if share else 1.0
    scaled = value / scale
    scaled = scaled - float(np.median((scaled - height)[near]))
    jump_m, jump_s = largest_jump(time_s[near], scaled[near], height[near], settings.jump_m)
    if jump_m:
        return Beside(time_s, value, f"it jumps by {jump_m:.0f} m at {jump_s:.0f} s where GNSS does not")
    return Beside(time_s, scaled, "", f"{scale:.3f} of the height of GNSS" if share > 0.5 else "")


def stuck(
    time_s: FloatArray, value: FloatArray, other: tuple[FloatArray, FloatArray], least_s: float, least: float
) -> float:
    """Return the length of the longest run of one value in which another sensor moves.

    It is 0 where there is none.

    Parameters
    ----------
    other : tuple of ndarrays
        Times and values of the other sensor.
    least_s : float
        Shorter runs do not count.
    least : float
        By so much the other sensor moves, its ends of 5 % left out.
    """
    edges = np.flatnonzero(np.concatenate([[True], np.diff(value) != 0.0, [True]]))
    longest = 0.0
    for a, b in zip(edges[:-1].tolist(), (edges[1:] - 1).tolist(), strict=True):
        length_s = float(time_s[b] - time_s[a])
        if length_s < max(least_s, longest):
            continue
        inside = other[1][(other[0] >= time_s[a]) & (other[0] <= time_s[b])]
        if len(inside) > 1:
            low, high = np.quantile(inside, [0.05, 0.95])
            longest = length_s if high - low > least else longest
    return longest


def scale_of(time_s: FloatArray, value: FloatArray, height_m: FloatArray, sigma_m: float) -> tuple[float, float]:
    """Return barometric over GNSS height and its sigma.

    They are 1 and infinity where the range is too small.

    A straight drift over time is fitted with it, residuals are weighted as Huber does.
    """
    low, high = np.quantile(height_m, [0.05, 0.95])
    if high - low < max(LEAST_RANGE_M, RANGE_SIGMAS * sigma_m):
        return 1.0, float("inf")
    span_s = max(float(time_s[-1] - time_s[0]), 1.0)
    columns = np.column_stack([np.ones(len(time_s)), (time_s - time_s[0]) / span_s, height_m - np.mean(height_m)])
    weight, solved = np.ones(len(time_s)), np.zeros(3)
    spread = 0.0
    for _ in range(ROUNDS):
        root = np.sqrt(weight)[:, None]
        solved = np.linalg.lstsq(columns * root, value * root[:, 0], rcond=None)[0]
        left = value - columns @ solved
        spread = max(GAUSSIAN_MAD * float(np.median(np.abs(left))), 1e-6)
        weight = np.minimum(1.0, 2.0 * spread / np.maximum(np.abs(left), 1e-9))
    covariance = np.linalg.pinv(columns.T @ (columns * weight[:, None])) * spread**2
    alike = max(1.0, ALIKE_S * len(time_s) / span_s)  # readings that say the same
    return float(solved[2]), float(np.sqrt(covariance[2, 2] * alike))


def _wrong_scale(scale: float, sigma: float, range_m: float, settings: AidSettings) -> str:
    if not np.isfinite(sigma):
        return ""
    off = scale - 1.0
    if abs(off) <= settings.scale_limit + SIGMA_SCALE * sigma or (off < 0.0 and range_m < LOW_RANGE_M):
        return ""
    unit = ": feet in place of metres" if abs(scale * M_PER_FOOT - 1.0) < FEET_SHARE else ""
    unit = ": metres taken for feet" if abs(scale / M_PER_FOOT - 1.0) < FEET_SHARE else unit
    return f"it moves by {scale:.2f} m where GNSS climbs by 1 m{unit}"


def largest_jump(time_s: FloatArray, value: FloatArray, height_m: FloatArray, least_m: float) -> tuple[float, float]:
    """Return the largest step that stays, and its time; zeros where there is none.

    It shows in the barometer from one second to the next, and GNSS does not show it.
    """
    beside = value - height_m
    rows = np.arange(1, len(time_s) - 1)
    rows = rows[(time_s[rows + 1] - time_s[rows - 1]) <= 4.0]
    if not len(rows):
        return 0.0, 0.0
    step, climbed = value[rows + 1] - value[rows - 1], height_m[rows + 1] - height_m[rows - 1]
    own = step - climbed
    usual = GAUSSIAN_MAD * float(np.median(np.abs(own - np.median(own))))
    limit = max(0.5 * least_m, JUMP_SIGMAS * usual)
    largest = (0.0, 0.0)
    for row in np.flatnonzero((np.abs(own) > limit) & (np.abs(climbed) < 0.5 * np.abs(own))).tolist():
        at = rows[row]
        before = beside[(time_s >= time_s[at] - BESIDE_S) & (time_s < time_s[at])]
        behind = beside[(time_s > time_s[at]) & (time_s <= time_s[at] + BESIDE_S)]
        if len(before) > 2 and len(behind) > 2:
            by = float(np.median(behind) - np.median(before))
            if abs(by) > max(least_m, abs(largest[0])):
                largest = (by, float(time_s[at]))
    return abs(largest[0]), largest[1]
