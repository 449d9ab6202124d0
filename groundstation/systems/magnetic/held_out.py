"""Residual of each correction on the part of the flight that no fit has seen."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.base.units import S_PER_H
from groundstation.methods import harmonics
from groundstation.systems.magnetic.answer import Alignment, HeldOut
from groundstation.systems.magnetic.apply import corrected_by_table
from groundstation.systems.magnetic.compass_table import CompassTable, bin_of
from groundstation.systems.magnetic.iron import Iron, derivatives
from groundstation.systems.magnetic.manoeuvre import OppositeTurns
from groundstation.systems.magnetic.poisson import IronFit, corrected_heading_deg
from groundstation.systems.magnetic.readings import Readings
from groundstation.systems.magnetic.settings import MagneticSettings

SECTOR_DEG = 30.0
LARGEST = 5000  # readings judged: of more, every k-th
LONGEST_STEP_S = 2.0  # counted as flown
STRETCH_S, SHORTEST_S = 30.0, 10.0  # level flight is compared by means over stretches


@dataclass(frozen=True)
class Unseen:
    """Held-out readings with the magnetic heading they should show.

    ``drift_sigma_deg`` is the sigma of the INS drift since the figure.
    """

    readings: Readings
    expected_deg: FloatArray
    drift_sigma_deg: float

    def error_deg(self, heading_deg: FloatArray) -> FloatArray:
        """Shown minus expected."""
        return wrap_180(heading_deg - self.expected_deg)


@dataclass(frozen=True)
class Remaining:
    """Error that remains after a correction: RMS and mean, and the sigma the mean should have."""

    rms_deg: float
    mean_deg: float
    mean_sigma_deg: float


def find_unseen(
    readings: Readings, is_airborne: BoolArray, figures: list[OppositeTurns], settings: MagneticSettings
) -> BoolArray:
    """Readings in flight that are in none of the figures, nor near their ends."""
    is_unseen = is_airborne.copy()
    for figure in figures:
        for one in figure.turns:
            low, high = one.turn.start_s - settings.held_out_margin_s, one.turn.end_s + settings.held_out_margin_s
            is_unseen &= (readings.time_s < low) | (readings.time_s > high)
    return is_unseen


def is_level(readings: Readings, settings: MagneticSettings) -> BoolArray:
    """Tell which readings are at small bank; corrections are judged by these."""
    return np.asarray(np.abs(readings.roll_deg) <= settings.held_out_bank_max_deg)


def hold_out(
    readings: Readings,
    declination_deg: FloatArray,
    is_airborne: BoolArray,
    figures: list[OppositeTurns],
    alignment: Alignment,
    settings: MagneticSettings,
) -> tuple[Unseen, HeldOut, NDArray[np.intp]] | None:
    """Level flight outside the figures, None where there is hardly any.

    The last are the rows of all its readings; of very many, every k-th is judged.
    """
    is_unseen = find_unseen(readings, is_airborne, figures, settings)
    rows = np.flatnonzero(is_unseen & is_level(readings, settings))
    if len(rows) < settings.held_out_samples_min:
        return None
    level = readings.take(rows)
    told = HeldOut(
        len(rows),
        float(np.sum(np.minimum(np.diff(level.time_s), LONGEST_STEP_S))),
        len(np.unique(level.true_heading_deg // SECTOR_DEG)),
        len(rows) / int(np.count_nonzero(is_unseen)),
        float(np.max(np.abs(level.roll_deg))),
    )
    kept: NDArray[np.intp] = rows[:: -(-len(rows) // LARGEST)]
    chosen = readings.take(kept)
    hours = abs(float(np.mean(chosen.time_s)) - alignment.figure_at_s) / S_PER_H
    expected = chosen.true_heading_deg - declination_deg[kept]
    return Unseen(chosen, expected, alignment.drift_sigma_deg_per_h * hours), told, rows


def remaining_uncorrected(unseen: Unseen) -> Remaining:
    """The uncorrected error."""
    return _remaining(unseen, unseen.readings.magnetic_heading_deg, 0.0)


def remaining_by_table(
    unseen: Unseen, table: CompassTable, deviation_deg: FloatArray, bias_deg: FloatArray
) -> Remaining:
    """Return the error that remains by the table.

    The forecast bank bias, shape (360,), is part of the sigma.
    """
    shown = unseen.readings.magnetic_heading_deg
    mean_columns = np.mean(harmonics.design(shown), axis=0)
    bias = float(np.sqrt(np.mean(bias_deg[bin_of(shown)] ** 2)))
    variance = float(mean_columns @ table.covariance @ mean_columns) + bias**2
    return _remaining(unseen, corrected_by_table(shown, deviation_deg), variance)


def remaining_by_iron(unseen: Unseen, fit: IronFit, azimuth_sigma_deg: float) -> Remaining:
    """Return the error that remains by freeing the readings of an iron.

    The covariance of the fit is part of the sigma. An error of the reference heading is in the fit and in the heading
    expected: what does not cancel counts.
    """

    def mean_of(iron: Iron) -> FloatArray:
        return np.array([np.mean(unseen.error_deg(corrected_heading_deg(iron, unseen.readings)))])

    slopes = derivatives(fit.iron, mean_of, max(abs(fit.earth.horizontal_nt), 1.0))
    through_azimuth = azimuth_sigma_deg * (float(slopes[0] @ fit.per_azimuth_deg) - 1.0)
    variance = float(slopes[0] @ fit.covariance @ slopes[0]) + through_azimuth**2
    return _remaining(unseen, corrected_heading_deg(fit.iron, unseen.readings), variance)


def seen_wander(unseen: Unseen, fit: IronFit) -> tuple[float, int]:
    """Return the sigma of the iron's residual from stretch to stretch, deg.

    Degrees of freedom come with it. This spread is what roll and pitch of the INS wander by, times Z / H, or whatever
    else changes as slowly: the field along the way, a load that is switched.
    """
    left = _of_stretches(unseen, unseen.error_deg(corrected_heading_deg(fit.iron, unseen.readings)))
    return (float(np.std(left, ddof=1)), len(left) - 1) if len(left) > 1 else (0.0, 0)


def advantage(unseen: Unseen, of_first_deg: FloatArray, of_second_deg: FloatArray) -> float:
    """Return by how many sigma a second error's mean square is smaller than that of a first.

    The two are compared stretch by stretch. 0 where fewer than three stretches tell.
    """
    gain = _of_stretches(unseen, of_first_deg**2 - of_second_deg**2)
    spread = float(np.std(gain, ddof=1)) if len(gain) > 2 else 0.0
    return float(np.mean(gain)) / spread * float(np.sqrt(len(gain))) if spread > 0.0 else 0.0


def stretch_numbers(time_s: FloatArray, length_s: float) -> NDArray[np.intp]:
    """Return the number of the stretch of each sample, from 0, shape (n,).

    A stretch ends after ``length_s`` or where a step is longer than ``LONGEST_STEP_S``.
    """
    is_first = np.diff(time_s, prepend=-np.inf) > LONGEST_STEP_S
    since_s = time_s - time_s[is_first][np.cumsum(is_first) - 1]
    return np.asarray(np.cumsum(is_first | (np.diff(since_s // length_s, prepend=0.0) > 0.0)) - 1)


def _of_stretches(unseen: Unseen, values: FloatArray) -> FloatArray:
    """Average values (n,) over stretches of level flight.

    A stretch is ``STRETCH_S`` long or what there is of it.
    """
    time_s = unseen.readings.time_s
    number = stretch_numbers(time_s, STRETCH_S)
    count = np.bincount(number)
    seconds = np.bincount(number, np.minimum(np.diff(time_s, prepend=time_s[0]), LONGEST_STEP_S))
    return np.asarray((np.bincount(number, values) / np.maximum(count, 1))[seconds >= SHORTEST_S])


def _remaining(unseen: Unseen, heading_deg: FloatArray, variance: float) -> Remaining:
    error = unseen.error_deg(heading_deg)
    mean = float(np.mean(error))
    spread = (error - mean)[:, None]
    scatter = float(harmonics.long_run(spread, harmonics.autocorrelation(spread[:, 0], 1))[0, 0]) / len(error) ** 2
    sigma = np.sqrt(max(variance, 0.0) + scatter + unseen.drift_sigma_deg**2)
    return Remaining(float(np.sqrt(np.mean(error**2))), mean, float(sigma))
