"""Growth of a difference between two tracks: rate, velocity, Schuler amplitude."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.methods.intervals import slope_through_origin
from groundstation.systems.inertial.units_answer import Measured

MEAN_S = 10.0  # differences are averaged over so long: what is left is not noise
RATE_FROM_S, S_PER_H = 600.0, 3600.0
SCHULER_S = 5064.0  # 84.4 min
LEAST_PERIOD = 0.75  # Schuler periods to tell an oscillation from a growth
MOSTLY = 0.5  # of the velocity, left by a wave from the start on: it is no tilt
FEWEST = 12  # means of 10 s


@dataclass(frozen=True)
class Noise:
    """Slow error of one axis of the reference: sigmas and correlation times."""

    position_m: float = 0.0
    velocity_mps: float = 0.0
    position_s: float = 1.0
    velocity_s: float = 1.0


@dataclass(frozen=True)
class Growth:
    """Growth of a difference; None where the tracks lack what it needs.

    Parameters
    ----------
    hours : float
        From the origin to the last difference.
    rate_nmiph : Measured or None
        Slope through the origin of the length of the position difference.
    rate_50_nmiph, rate_95_nmiph : float or None
        Length over time, median and 95 %, later than ten minutes.
    velocity_mps, schuler_mps : Measured or None
        RMS of the velocity difference; amplitude of its part with the Schuler period.
    largest_m : Measured or None
    largest_at_s : float or None
    is_drift : bool
        Whether its velocity is more that of a gyro's drift than that of a tilt at the start.
    """

    hours: float
    rate_nmiph: Measured | None = None
    rate_50_nmiph: float | None = None
    rate_95_nmiph: float | None = None
    velocity_mps: Measured | None = None
    schuler_mps: Measured | None = None
    largest_m: Measured | None = None
    largest_at_s: float | None = None
    is_drift: bool = False


NO_NOISE = Noise()


def growth_of(
    elapsed_s: FloatArray,
    position_m: FloatArray,
    velocity_mps: FloatArray,
    noise: Noise = NO_NOISE,
    *,
    from_first: bool = False,
    reset_s: tuple[float, ...] = (),
) -> Growth | None:
    """Return the growth of a difference; None where there is too little of it.

    Parameters
    ----------
    elapsed_s : ndarray, shape (n,)
        Seconds since navigation began; evenly spaced. Rows before it are left out.
    position_m, velocity_mps : ndarray, shape (n, 2)
        North and east, NaN where unknown.
    noise : Noise
        Of the reference, for the intervals.
    from_first : bool
        Count the position from its first value: nobody knows when navigation began.
    reset_s : tuple of float
        Elapsed seconds at which the position was set: the rate counts from there on.
    """
    rows = elapsed_s >= 0.0
    time_s, both = means_of(elapsed_s[rows], np.column_stack([position_m, velocity_mps])[rows])
    if len(time_s) < FEWEST:
        return None
    position, velocity = both[:, :2], both[:, 2:]
    has_place = np.isfinite(position).all(axis=1)
    has_speed = np.isfinite(velocity).all(axis=1)
    found: dict[str, object] = {}
    if has_place.sum() >= FEWEST:
        placed = position[has_place]
        placed = placed - placed[0] if from_first else placed
        found |= _of_position(time_s[has_place], placed, noise, reset_s, from_first=from_first)
    if has_speed.sum() >= FEWEST:
        found |= _of_velocity(time_s[has_speed], velocity[has_speed], noise)
    if not found:
        return None
    known = time_s[has_place | has_speed]
    return Growth(float(known[-1]) / S_PER_H, **found)  # type: ignore[arg-type]


def means_of(time_s: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return means over :data:`MEAN_S`, NaN where nothing is known."""
    if not len(time_s):
        return time_s, values
    bins = np.floor(time_s / MEAN_S).astype(np.int64)
    bins -= bins[0]
    count, known = int(bins[-1]) + 1, np.isfinite(values)
    out = np.full((count, values.shape[1]), np.nan)
    for column in range(values.shape[1]):
        rows = known[:, column]
        number = np.bincount(bins[rows], minlength=count)
        total = np.bincount(bins[rows], weights=values[rows, column], minlength=count)
        out[:, column] = np.where(number > 0, total / np.maximum(number, 1), np.nan)
    number = np.bincount(bins, minlength=count)
    mean_s = np.bincount(bins, weights=time_s, minlength=count) / np.maximum(number, 1)
    return mean_s[number > 0], out[number > 0]


def _of_position(
    time_s: FloatArray, position_m: FloatArray, noise: Noise, reset_s: tuple[float, ...], *, from_first: bool
) -> dict[str, object]:
    """Return rate and largest value; counted from the first one, its error is in all."""
    began_s = np.concatenate([[0.0], np.sort(reset_s)])
    since_s = time_s - began_s[np.searchsorted(began_s, time_s, side="right") - 1]
    hours, radial = since_s / S_PER_H, np.hypot(*position_m.T)
    rate = slope_through_origin(hours, radial / M_PER_NAUTICAL_MILE, np.ones(len(hours)))
    per_hour2 = float(np.sum(hours**2)) * MEAN_S
    own = 2.0 * noise.position_s / max(per_hour2, 1e-9)
    of_first = (float(np.sum(hours)) * MEAN_S / max(per_hour2, 1e-9)) ** 2 if from_first else 0.0
    sigma = noise.position_m * np.sqrt(own + of_first) / M_PER_NAUTICAL_MILE
    largest = int(np.argmax(radial))
    found: dict[str, object] = {
        "rate_nmiph": Measured(rate, float(NORMAL_95 * sigma)),
        "largest_m": Measured(float(radial[largest]), NORMAL_95 * noise.position_m * (1.0 + from_first) ** 0.5),
        "largest_at_s": float(time_s[largest]),
    }
    late = since_s > RATE_FROM_S
    if late.any():
        over_time = radial[late] / M_PER_NAUTICAL_MILE / hours[late]
        found |= {"rate_50_nmiph": float(np.median(over_time)), "rate_95_nmiph": float(np.quantile(over_time, 0.95))}
    return found


def _of_velocity(time_s: FloatArray, velocity_mps: FloatArray, noise: Noise) -> dict[str, object]:
    rms = float(np.sqrt(np.mean(np.sum(velocity_mps**2, axis=1))))
    length_s = max(float(np.ptp(time_s)), MEAN_S)
    few = min(2.0 * noise.velocity_s / length_s, 1.0)  # one over the number of independent errors
    half = NORMAL_95 * noise.velocity_mps * np.sqrt(few) + noise.velocity_mps**2 / max(rms, noise.velocity_mps, 1e-9)
    found: dict[str, object] = {
        "velocity_mps": Measured(rms, float(half)),
        "is_drift": _is_drift(time_s, velocity_mps, rms),
    }
    if length_s >= LEAST_PERIOD * SCHULER_S:
        turn = 2.0 * np.pi * time_s / SCHULER_S
        wave = np.column_stack([np.cos(turn), np.sin(turn)])
        design = np.column_stack([np.ones(len(time_s)), time_s / length_s, wave])
        fitted = np.linalg.lstsq(design, velocity_mps, rcond=None)[0]
        gain = np.linalg.inv(design.T @ design)[2:, 2:]
        spread = noise.velocity_mps * np.sqrt(float(np.max(np.linalg.eigvalsh(gain))) * 2.0 * noise.velocity_s / MEAN_S)
        amplitude = float(np.sqrt(np.sum(fitted[2:] ** 2)))
        found["schuler_mps"] = Measured(amplitude, float(NORMAL_95 * spread))
    return found


def _is_drift(time_s: FloatArray, velocity_mps: FloatArray, rms: float) -> bool:
    """Tell whether velocity errors look more like a drift than like a tilt at the start.

    A tilt, or an error of velocity, makes a wave from the start on; drift makes its velocity grow to one side.
    """
    turn = 2.0 * np.pi * time_s / SCHULER_S

    def left(*columns: FloatArray) -> float:
        design = np.column_stack(columns)
        rest = velocity_mps - design @ np.linalg.lstsq(design, velocity_mps, rcond=None)[0]
        return float(np.sqrt(np.mean(np.sum(rest**2, axis=1))))

    by_tilt, by_drift = left(np.sin(turn), np.cos(turn)), left(1.0 - np.cos(turn))
    return by_tilt > min(by_drift, MOSTLY * rms)
