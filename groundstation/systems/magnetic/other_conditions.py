"""Deviation under conditions other than those of the figure.

Pitch, a current that flows only in the air or only on the ground, and gains that drift, with temperature for instance.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, mean_heading, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray
from groundstation.base.units import S_PER_H
from groundstation.methods import harmonics
from groundstation.systems.magnetic.answer import MethodName, OtherCondition, vector_of
from groundstation.systems.magnetic.attitude import field_in_body, levelled_heading_deg
from groundstation.systems.magnetic.compass_table import fit_to_circle
from groundstation.systems.magnetic.held_out import stretch_numbers
from groundstation.systems.magnetic.iron import HEADINGS_DEG, Iron, curve_rms, derivatives, heading_errors
from groundstation.systems.magnetic.poisson import EarthField, IronFit
from groundstation.systems.magnetic.readings import Readings
from groundstation.tables.table import Flight

AXES = ("forward", "right", "down")
STRETCH_S, LEAST_STRETCHES = 20.0, 2
PLACE_SIGMA_NT = 60.0  # of the field on the ground against that of the figure: height and place, beyond the model
TELLING_SIGMAS = 2.0
LEAST_SPAN_H = 0.05
# Twice a correlation time of the wander of roll and pitch: over a longer flight it averages out. 120 s is that of the
# plain family (docs/evidence/magnetic.md); FIGURE_WANDER_S takes another time for the same wander.
FLIGHT_WANDER_S = 240.0
PITCH_STEP_DEG = 1.0


@dataclass(frozen=True)
class FlownConditions:
    """Flown conditions: readings with the aligned heading, and masks of them.

    The masks tell which are in the air, in the figures and level.
    """

    readings: Readings
    is_airborne: BoolArray
    in_figure: BoolArray
    is_level: BoolArray
    pitch_deg: float


def other_conditions(
    flight: Flight, flown: FlownConditions, fit: IronFit, method: MethodName, *, wander_deg: float
) -> tuple[OtherCondition, ...]:
    """Tell how far the deviation differs at another pitch, on the ground and as gains drift.

    ``wander_deg``: how far roll and pitch of the INS wander over minutes.
    """
    if fit.reason:
        return (_pitch_without_iron(flown, fit.earth),)
    rows = (_pitch(flown, fit), _on_ground(flight, flown, fit), _gains(flight, flown, fit, method, wander_deg))
    return tuple(row for row in rows if row is not None)


def _pitch_flown(flown: FlownConditions) -> tuple[float, str]:
    """Return the pitch farthest from the figure's that was flown level or stood at.

    A text comes with it: where pitch was.
    """
    parts = {"in level flight": flown.is_level & ~flown.in_figure, "on the ground": ~flown.is_airborne}
    seen = {name: flown.readings.pitch_deg[rows] for name, rows in parts.items() if np.count_nonzero(rows) > 1}
    ends = {name: np.quantile(values, (0.05, 0.95)) for name, values in seen.items()}
    told = "".join(f", {_signed(low)} to {_signed(high)} {name}" for name, (low, high) in ends.items())
    every = np.concatenate([*ends.values(), [flown.pitch_deg]])
    return float(
        every[np.argmax(np.abs(every - flown.pitch_deg))]
    ), f"{_signed(flown.pitch_deg)} deg in the figures{told}"


def _signed(value_deg: float) -> str:
    """One decimal, without a negative zero."""
    return f"{round(value_deg, 1) + 0.0:+.1f}"


def _pitch_without_iron(flown: FlownConditions, earth: EarthField) -> OtherCondition:
    _farthest, told = _pitch_flown(flown)
    text = f"pitch {told}; {_of_levelling(earth)}; without a fitted iron what the iron adds is not known"
    return OtherCondition("pitch", None, None, None, text)


def _of_levelling(earth: EarthField) -> str:
    size_deg = earth.per_tilt
    return f"1 deg of pitch wrong in what levels the field is {size_deg:.1f} deg on east and west (tan of dip)"


def _pitch(flown: FlownConditions, fit: IronFit) -> OtherCondition:
    """The iron turned by another pitch: size for each degree."""
    strengths = fit.earth.horizontal_nt, fit.earth.down_nt

    def change(iron: Iron, pitch_deg: float) -> FloatArray:
        curves = [heading_errors(iron, *strengths, 0.0, pitch) for pitch in (pitch_deg, flown.pitch_deg)]
        return wrap_180(curves[0] - curves[1])

    by_degree = change(fit.iron, flown.pitch_deg + PITCH_STEP_DEG)
    slopes = derivatives(
        fit.iron, lambda iron: fit_to_circle(change(iron, flown.pitch_deg + PITCH_STEP_DEG)), strengths[0]
    )
    sigma = float(np.sqrt(harmonics.OVER_CIRCLE @ np.diag(slopes @ fit.covariance @ slopes.T)))
    farthest, told = _pitch_flown(flown)
    most = float(np.max(np.abs(change(fit.iron, farthest))))
    text = f"pitch {told}: up to {most:.2f} deg at {_signed(farthest)} deg; {_of_levelling(fit.earth)}"
    return OtherCondition("pitch", curve_rms(by_degree), sigma, float(np.max(np.abs(by_degree))), text)


def _on_ground(flight: Flight, flown: FlownConditions, fit: IronFit) -> OtherCondition | None:
    """Return what the readings on the ground have more than the figure's iron makes.

    The difference is taken for a steady vector in the body.
    """
    rows = np.flatnonzero(~flown.is_airborne)
    left = flown.readings.take(rows)
    if not len(left):
        return None
    residual = left.field_nt - _expected_nt(flight, flown, rows, fit)
    stretches = _means(left.time_s, residual)
    if len(stretches) < LEAST_STRETCHES:
        return None
    added = np.mean(stretches, axis=0)
    scatter = np.std(stretches, axis=0, ddof=1) / np.sqrt(len(stretches))
    sigma_nt = np.hypot(scatter, PLACE_SIGMA_NT)
    horizontal, down = fit.earth.horizontal_nt, fit.earth.down_nt
    moved = replace(fit.iron, hard_nt=fit.iron.hard_nt + added)
    change = wrap_180(
        heading_errors(moved, horizontal, down, 0.0, flown.pitch_deg)
        - heading_errors(fit.iron, horizontal, down, 0.0, flown.pitch_deg)
    )
    size, sigma = curve_rms(change), float(np.rad2deg(np.hypot(*sigma_nt[:2]) / horizontal / np.sqrt(2.0)))
    told = ", ".join(f"{value:+.0f}" for value in added)
    is_seen = size > TELLING_SIGMAS * sigma
    text = f"on the ground the readings have {told} nT more than the iron of the figures makes ({_current(flown)})"
    text += (
        ": a current that flows only in the air or only on the ground, or iron in the apron"
        if is_seen
        else ": not beyond chance"
    )
    return OtherCondition("ground", size, sigma, float(np.max(np.abs(change))), text, vector_of(added))


def _current(flown: FlownConditions) -> str:
    """Currents on the ground and in the figures, where they are logged."""
    current = flown.readings.current_a
    parts = [current[rows][np.isfinite(current[rows])] for rows in (~flown.is_airborne, flown.in_figure)]
    means = [float(np.mean(part)) if part.size else float("nan") for part in parts]
    if not np.isfinite(means).all():
        return "no current in the log"
    return f"current {means[0]:.0f} A there, {means[1]:.0f} A in the figures"


def _gains(
    flight: Flight, flown: FlownConditions, fit: IronFit, method: MethodName, wander_deg: float
) -> OtherCondition | None:
    """Return how the axis gains change with time, from all that was flown, and the effect.

    The effect is that at the time farthest from the figure. Roll and pitch that wander over minutes move the axes
    forward and right as a gain does that changes: in the sigma.
    """
    rows = np.flatnonzero(flown.is_airborne)
    flying = flown.readings.take(rows)
    centre_s = float(np.mean(flown.readings.time_s[flown.in_figure]))
    hours = (flying.time_s - centre_s) / S_PER_H
    span_h = float(np.ptp(hours)) if len(hours) else 0.0
    if span_h < LEAST_SPAN_H:
        return None
    expected = _expected_nt(flight, flown, rows, fit)
    found = [_rate(hours, expected[:, axis], flying.field_nt[:, axis]) for axis in range(3)]
    rate, sigma_rate = (np.array(part) for part in zip(*found, strict=True))
    level_nt = np.sqrt(np.mean(expected[:, :2] ** 2)) * float(np.std(hours))
    wander_nt = abs(fit.earth.down_nt) * np.deg2rad(wander_deg) / np.sqrt(max(span_h * S_PER_H / FLIGHT_WANDER_S, 1.0))
    sigma_rate[:2] = np.hypot(sigma_rate[:2], wander_nt / max(level_nt, 1e-9))
    farthest_h = float(hours[np.argmax(np.abs(hours))])
    size = _of_gain(fit, flown.pitch_deg, rate * farthest_h, method)
    each = [curve_rms(_of_gain(fit, flown.pitch_deg, step, method)) for step in np.diag(sigma_rate * farthest_h)]
    told = ", ".join(
        f"{axis} {value:+.2f} +- {sigma:.2f}"
        for axis, value, sigma in zip(AXES, 100.0 * rate, 100.0 * sigma_rate, strict=True)
    )
    sigma = float(np.hypot.reduce(each))
    text = f"gain, % per hour: {told}; size {abs(farthest_h) * 60.0:.0f} min from the figures"
    is_seen = curve_rms(size) > TELLING_SIGMAS * sigma
    text += ", as of a sensor that warms or cools" if is_seen else ": not beyond chance"
    return OtherCondition("gain", curve_rms(size), sigma, float(np.max(np.abs(size))), text)


def _of_gain(fit: IronFit, pitch_deg: float, gain: FloatArray, method: MethodName) -> FloatArray:
    """Return the corrected heading's error on every heading when gains have grown, degrees.

    The axes read ``gain`` (3,) of themselves more. A table sees what the axes differ by; the iron fit, which takes off
    a hard iron that grew with them, all of it.
    """
    level = np.zeros(len(HEADINGS_DEG)), np.full(len(HEADINGS_DEG), pitch_deg)
    field = field_in_body(fit.earth.horizontal_nt, fit.earth.down_nt, HEADINGS_DEG, *level)
    reading = field @ fit.iron.soft.T + fit.iron.hard_nt
    grown = reading * (1.0 + gain)
    if method == "compass_table":
        return wrap_180(levelled_heading_deg(grown, *level) - levelled_heading_deg(reading, *level))
    return wrap_180(levelled_heading_deg(fit.iron.field_nt(grown), *level) - HEADINGS_DEG)


def _rate(hours: FloatArray, expected_nt: FloatArray, reading_nt: FloatArray) -> tuple[float, float]:
    """Return the change of one axis' gain per hour, and its sigma.

    reading - expected = constant + rate x hours x expected. Residuals are correlated; the constant and a steady drift
    of the offset are fitted with it.
    """
    columns = np.stack([hours * expected_nt, np.ones_like(hours), hours, expected_nt], axis=1)
    scale = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-12)
    scaled = columns / scale
    bread = np.linalg.pinv(scaled.T @ scaled)
    values = bread @ scaled.T @ (reading_nt - expected_nt)
    residual = reading_nt - expected_nt - scaled @ values
    correlation = harmonics.autocorrelation(residual, len(values))
    middle = harmonics.long_run(scaled * residual[:, None], correlation)
    middle = middle * harmonics.inflation(len(residual), len(values), correlation)
    sigma = float(np.sqrt(max((bread @ middle @ bread)[0, 0], 0.0)))
    return float(values[0] / scale[0]), sigma / float(scale[0])


def _of_current(iron: Iron, readings: Readings) -> FloatArray:
    """Return what the logged current adds, shape (n, 3)."""
    if iron.current_nt_per_a is None:
        return np.zeros((len(readings), 3))
    return np.nan_to_num(readings.current_a - iron.current_reference_a)[:, None] * iron.current_nt_per_a


def _expected_nt(flight: Flight, flown: FlownConditions, rows: NDArray[np.intp], fit: IronFit) -> FloatArray:
    """Readings that the iron makes at some rows, shape (n, 3).

    The field is that of the fit and, along the way, what the model has more there than in the figures.
    """
    part, earth = flown.readings.take(rows), fit.earth
    declination, horizontal, down = _along(flight, flown, rows, fit)
    heading = wrap_180(part.true_heading_deg - earth.declination_deg - declination)
    north, vertical = earth.horizontal_nt + horizontal, earth.down_nt + down
    unit = [field_in_body(*of, heading, part.roll_deg, part.pitch_deg) for of in ((1.0, 0.0), (0.0, 1.0))]
    field = north[:, None] * unit[0] + vertical[:, None] * unit[1]
    return np.asarray(field @ fit.iron.soft.T + fit.iron.hard_nt + _of_current(fit.iron, part))


def _along(
    flight: Flight, flown: FlownConditions, rows: NDArray[np.intp], fit: IronFit
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what the model has more of declination, H and Z at some rows than in the figures.

    Shapes (n,); zero without a model.
    """
    none = np.zeros(len(rows))
    if not (flight.has_utc and fit.earth.is_modelled):
        return none, none, none
    readings = flown.readings
    try:
        model = declination_along(
            readings.latitude_deg, readings.longitude_deg, readings.altitude_m, int(flight.start_ns)
        )
    except NotAssessableError:
        return none, none, none
    figure = flown.in_figure
    declination = wrap_180(model.values_deg[rows] - mean_heading(model.values_deg[figure]))
    strengths = [part[rows] - float(np.nanmean(part[figure])) for part in (model.horizontal_nt, model.down_nt)]
    return np.nan_to_num(declination), np.nan_to_num(strengths[0]), np.nan_to_num(strengths[1])


def _means(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Means of values (n, c) over stretches of so many seconds without a gap, shape (m, c)."""
    number = stretch_numbers(time_s, STRETCH_S)
    count = np.bincount(number)
    means = np.stack([np.bincount(number, column) / np.maximum(count, 1) for column in values.T], axis=1)
    return np.asarray(means[count >= 0.5 * np.median(count)])
