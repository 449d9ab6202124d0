"""Iron of the aircraft: its effect on the field, the heading, and opposite banks' average."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.systems.magnetic.answer import Matrix, PoissonParameters, vector_of
from groundstation.systems.magnetic.attitude import field_in_body, levelled_heading_deg
from groundstation.systems.magnetic.compass_table import CENTRES_DEG, fit_to_circle

HEADINGS_DEG: FloatArray = np.arange(0.0, 360.0, 0.5)
PART_STEP = 1e-4  # of the earth's field, or of a soft-iron element, in numerical derivatives


@dataclass(frozen=True)
class Iron:
    """Iron model: reading = soft @ field + hard_nt + current_nt_per_a x (current - reference).

    Shapes (3, 3), (3,), (3,).
    """

    soft: FloatArray
    hard_nt: FloatArray
    current_nt_per_a: FloatArray | None = None
    current_reference_a: float = 0.0

    def field_nt(self, reading_nt: FloatArray, current_a: FloatArray | None = None) -> FloatArray:
        """Return the earth's field along the body axes, shape (n, 3), from readings.

        Unknown currents count as the reference.
        """
        free = reading_nt - self.hard_nt
        if self.current_nt_per_a is not None and current_a is not None:
            excess = np.nan_to_num(current_a - self.current_reference_a)
            free = free - excess[:, None] * self.current_nt_per_a
        return np.asarray(np.linalg.solve(self.soft, free.T).T, dtype=np.float64)

    def vector(self) -> FloatArray:
        """Parameters in a row: the soft iron by rows, hard iron, current effect."""
        current = [] if self.current_nt_per_a is None else [self.current_nt_per_a]
        return np.concatenate([self.soft.ravel(), self.hard_nt, *current])

    def withvector_of(self, vector: FloatArray) -> "Iron":
        """The iron of a vector of parameters."""
        current = vector[12:] if self.current_nt_per_a is not None else None
        return Iron(vector[:9].reshape(3, 3), vector[9:12], current, self.current_reference_a)


def iron_of(parameters: PoissonParameters) -> Iron:
    """The iron that a result states."""
    effect = parameters.current_effect_nt_per_a
    return Iron(
        np.array(parameters.soft_iron),
        np.array(parameters.hard_iron_nt),
        None if effect is None else np.array(effect),
        parameters.current_reference_a or 0.0,
    )


def parameters_of(iron: Iron, covariance: FloatArray) -> PoissonParameters:
    """The result of a fit, with the sigmas that a covariance of :meth:`Iron.vector` says."""
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    has_current = iron.current_nt_per_a is not None
    return PoissonParameters(
        vector_of(iron.hard_nt),
        vector_of(sigma[9:12]),
        _matrix(iron.soft),
        _matrix(sigma[:9].reshape(3, 3)),
        vector_of(iron.current_nt_per_a) if iron.current_nt_per_a is not None else None,
        vector_of(sigma[12:15]) if has_current else None,
        iron.current_reference_a if has_current else None,
    )


def heading_errors(
    iron: Iron, horizontal_nt: float, down_nt: float, bank_deg: float = 0.0, pitch_deg: float = 0.0
) -> FloatArray:
    """Return the error of the uncorrected heading in each bin of it, shape (360,), at a bank.

    Heading and bins are magnetic; the error is that in the middle of the bin.
    """
    field = _fields_nt(horizontal_nt, down_nt, bank_deg, pitch_deg)
    level = np.full(1, bank_deg), np.full(1, pitch_deg)
    shown = levelled_heading_deg(field @ iron.soft.T + iron.hard_nt, *level)
    error = wrap_180(shown - HEADINGS_DEG)
    order = np.argsort(shown)
    return np.asarray(np.interp(CENTRES_DEG, shown[order], error[order], period=360.0))


@lru_cache(maxsize=16)
def _fields_nt(horizontal_nt: float, down_nt: float, bank_deg: float, pitch_deg: float) -> FloatArray:
    """Return the earth's field in the body on every heading, shape (720, 3).

    The field is the same for the hundreds of irons of a fit.
    """
    level = np.full(len(HEADINGS_DEG), bank_deg), np.full(len(HEADINGS_DEG), pitch_deg)
    return frozen(field_in_body(horizontal_nt, down_nt, HEADINGS_DEG, *level))


def bank_bias(iron: Iron, horizontal_nt: float, down_nt: float, bank_deg: float, pitch_deg: float = 0.0) -> FloatArray:
    """Return the bias of the average of opposite banks against level flight, shape (360,).

    The bias grows as bank squared.
    """
    at = [heading_errors(iron, horizontal_nt, down_nt, bank, pitch_deg) for bank in (bank_deg, -bank_deg, 0.0)]
    return wrap_180(0.5 * (at[0] + at[1]) - at[2])


def curve_rms(curve_deg: FloatArray) -> float:
    """RMS of a heading error over the circle."""
    return float(np.sqrt(np.mean(np.square(curve_deg))))


def level_coefficients(
    iron: Iron, covariance: FloatArray, horizontal_nt: float, down_nt: float, pitch_deg: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return A to E of level flight that an iron makes, with covariance.

    Shapes (5,) and (5, 5).
    """

    def coefficients(other: Iron) -> FloatArray:
        return fit_to_circle(heading_errors(other, horizontal_nt, down_nt, 0.0, pitch_deg))

    slopes = derivatives(iron, coefficients, horizontal_nt)
    return coefficients(iron), slopes @ covariance @ slopes.T


def derivatives(iron: Iron, function: Callable[[Iron], FloatArray], horizontal_nt: float) -> FloatArray:
    """Central differences of a function of the iron by its parameters, shape (m, k)."""
    vector = iron.vector()
    step = PART_STEP * np.where(np.arange(len(vector)) < 9, 1.0, horizontal_nt)
    columns = []
    for place in range(len(vector)):
        nudge = np.where(np.arange(len(vector)) == place, step, 0.0)
        high, low = function(iron.withvector_of(vector + nudge)), function(iron.withvector_of(vector - nudge))
        columns.append((high - low) / (2.0 * step[place]))
    return np.stack(columns, axis=-1)


def _matrix(values: FloatArray) -> Matrix:
    first, second, third = (vector_of(row) for row in values)
    return first, second, third
