"""Corrections applied: a table, coefficients or iron to readings of the magnetic heading."""

from collections.abc import Mapping, Sequence

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.methods import harmonics
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import PoissonParameters
from groundstation.systems.magnetic.attitude import levelled_heading_deg
from groundstation.systems.magnetic.compass_table import CENTRES_DEG
from groundstation.systems.magnetic.iron import iron_of


def corrected_by_table(reading_deg: FloatArray, deviation_deg: Sequence[float] | FloatArray) -> FloatArray:
    """Correct headings by a table: magnetic heading = reading + deviation, in [0, 360).

    The table is interpolated between the middles of its bins.

    Parameters
    ----------
    reading_deg : ndarray, shape (n,)
        Uncorrected magnetic heading.
    deviation_deg : sequence of 360
        ``MagneticResult.deviation_deg``: minus the error.

    Examples
    --------
    The compass shows 92.5 where magnetic heading is 90: the error is +2.5 deg, the deviation to add -2.5 deg.

    >>> float(corrected_by_table(np.array([92.5]), np.full(360, -2.5))[0])
    90.0
    """
    reading = np.asarray(reading_deg, dtype=np.float64)
    return wrap_360(reading + np.interp(reading, CENTRES_DEG, np.asarray(deviation_deg), period=360.0))


def corrected_by_coefficients(reading_deg: FloatArray, coefficients_deg: Mapping[str, float]) -> FloatArray:
    """Correct headings by A to E, c being the reading, in [0, 360).

    Magnetic heading = reading - (A + B sin c + C cos c + D sin 2c + E cos 2c).

    Examples
    --------
    >>> error = {"A": 1.0, "B": 2.0, "C": 0.0, "D": 0.0, "E": 0.0}
    >>> corrected_by_coefficients(np.array([90.0, 270.0]), error).tolist()
    [87.0, 271.0]
    """
    reading = np.asarray(reading_deg, dtype=np.float64)
    return wrap_360(reading - harmonics.design(reading) @ np.array([coefficients_deg[letter] for letter in LETTERS]))


def corrected_by_iron(
    field_nt: FloatArray,
    roll_deg: FloatArray,
    pitch_deg: FloatArray,
    parameters: PoissonParameters,
    current_a: FloatArray | None = None,
) -> FloatArray:
    """Return magnetic headings in [0, 360) from readings freed of the iron, and the attitude.

    Parameters
    ----------
    field_nt : ndarray, shape (n, 3)
        Along forward, right, down.
    roll_deg, pitch_deg, current_a : ndarray, shape (n,)
    parameters : PoissonParameters
    """
    return levelled_heading_deg(iron_of(parameters).field_nt(field_nt, current_a), roll_deg, pitch_deg)
