"""Opposite turns of a flux valve, and what bank and lag leave in their mean."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import DEG_PER_RAD
from groundstation.methods import harmonics
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import Turn
from groundstation.systems.magnetic.attitude import field_in_body
from groundstation.systems.magnetic.compass_table import build_table
from groundstation.systems.magnetic.flux_answer import BankError, FluxMethod, FluxMethodName
from groundstation.systems.magnetic.flux_bank import CIRCLE_DEG, LagCell, turns_bias
from groundstation.systems.magnetic.flux_epochs import GRAVITY_MPS2, FluxEpochs
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.ground_fit import CurveFit
from groundstation.systems.magnetic.manoeuvre import find_figures, find_turns
from groundstation.systems.magnetic.readings import Readings
from groundstation.systems.magnetic.settings import MagneticSettings

NAME: FluxMethodName = "opposite_turns"
LEAST_READINGS = 40


@dataclass(frozen=True)
class OppositeMethod:
    """The row of the method, and its fit where it is not refused."""

    row: FluxMethod
    fit: CurveFit | None = None


def by_opposite_turns(
    epochs: FluxEpochs,
    true_deg: FloatArray,
    bank: BankError,
    cells: tuple[LagCell, ...],
    common_sigma_deg: float,
    settings: MagneticFluxSettings,
    magnetic: MagneticSettings,
) -> OppositeMethod:
    """Average the error over opposite turns; refuse it where bank or lag leave too much.

    What is odd in bank cancels. What is even does not: a valve that leans by b at a dip of I errs by about
    (tan I x b)^2 / 2, and a display that lags by T shows a harmonic of order n at a turn rate w less by
    1 / (1 + (n w T)^2).
    """
    readings, rows = _readings(epochs, true_deg)
    if len(readings) < LEAST_READINGS:
        return _refused("hardly a reading with a true heading and a bank")
    figures, turns = find_figures(readings, find_turns(readings, epochs.is_airborne[rows], magnetic), magnetic)
    if not figures:
        return _refused(_why(tuple(one.turn for one in turns)))
    right, left = (np.sort(np.concatenate([one.rows(side) for one in figures])) for side in (True, False))
    table = build_table(readings.magnetic_heading_deg, readings.compass_error_deg, right, left)
    values = table.coefficients_deg.copy()
    declination = float(np.mean(epochs.declination_deg[rows][right]))
    values[0] = wrap_180(values[0] + declination)
    if bank.state != "found":
        return _refused(f"the bank error is not known: {bank.reason}")
    flown = float(np.mean(np.abs(readings.roll_deg[np.concatenate([right, left])])))
    speed = float(np.nanmedian(epochs.speed_mps[rows][right]))
    rate = DEG_PER_RAD * GRAVITY_MPS2 * np.tan(np.deg2rad(flown)) / speed
    bias = turns_bias(cells, values, flown, rate, float(np.nanmedian(epochs.per_tilt)))
    size = float(np.sqrt(np.mean(bias**2)))
    if size > settings.turns_bias_max_deg:
        reason = f"bank and lag leave {size:.2g} deg rms in the mean of turns at {flown:.0f} deg of bank"
        return _refused(f"{reason}, at most {settings.turns_bias_max_deg:g}")
    added = harmonics.fit(CIRCLE_DEG, bias)[0]
    covariance = table.covariance + np.diag(added**2)
    sigma = np.sqrt(np.diag(covariance) + np.array([common_sigma_deg**2, 0.0, 0.0, 0.0, 0.0]))
    row = FluxMethod(
        NAME,
        "fitted",
        "",
        table.samples,
        dict(zip(LETTERS, map(float, values), strict=True)),
        dict(zip(LETTERS, map(float, sigma), strict=True)),
    )
    return OppositeMethod(row, CurveFit(values, covariance, 0.0))


def _readings(epochs: FluxEpochs, true_deg: FloatArray) -> tuple[Readings, np.ndarray]:
    """Return the epochs as readings of a field that has the heading, with their rows."""
    rows = np.flatnonzero(np.isfinite(true_deg) & np.isfinite(epochs.roll_deg) & epochs.is_airborne)
    heading, roll, pitch = epochs.heading_deg[rows], epochs.roll_deg[rows], np.zeros(len(rows))
    unknown = np.full(len(rows), np.nan)
    field = field_in_body(1.0, 0.0, heading, roll, pitch)
    readings = Readings(
        epochs.time_s[rows],
        field,
        roll,
        pitch,
        wrap_360(true_deg[rows]),
        epochs.altitude_m[rows],
        unknown,
        unknown,
        unknown,
    )
    return readings, rows


def _why(turns: tuple[Turn, ...]) -> str:
    if not turns:
        return "no turn of steady bank"
    longest = max(turns, key=lambda one: abs(one.turned_deg))
    return (
        f"no opposite turns that cover the circle: the longest turns {longest.turned_deg:+.0f} deg ({longest.reason})"
    )


def _refused(reason: str) -> OppositeMethod:
    return OppositeMethod(FluxMethod(NAME, "refused", reason))
