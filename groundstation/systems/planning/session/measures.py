"""Measures of the geometry at one epoch, with derivatives.

They are the determinant, the least eigenvalue and the dilution of precision. H holds a row for each source that the
judged aircraft ranges to: the direction from the source to it, in the axes asked for, and 1 for the clock.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, equation (29) (determinant); arXiv
2411.03747 (least eigenvalue); Misra and Enge, Global Positioning System, 2nd ed. 2006, section 6.1 (dilution).
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.planning.session.scenario import Axis, LocalCriterion

COLUMN: dict[Axis, int] = {"north": 0, "east": 1, "up": 2, "clock": 3}
SINGULAR = 1e-12  # of the least eigenvalue over the number of sources: less is rounding


@dataclass(frozen=True)
class InformationModes:
    """Eigenvalues (epochs, a), ascending, and vectors (epochs, a, a) of H'H at each epoch.

    ``H`` has shape (epochs, l, a).
    """

    H: FloatArray
    eigenvalues: FloatArray
    vectors: FloatArray

    @property
    def determinant(self) -> FloatArray:
        """det(H'H), shape (epochs,); 0 where it is nothing but rounding."""
        return np.where(self.is_singular, 0.0, np.prod(self.eigenvalues, axis=1))

    @property
    def least_eigenvalue(self) -> FloatArray:
        """Least eigenvalue of H'H, shape (epochs,)."""
        return self.eigenvalues[:, 0]

    @property
    def is_singular(self) -> np.ndarray:
        """Epochs at which the sources do not tell all axes apart, shape (epochs,)."""
        return np.asarray(self.eigenvalues[:, 0] <= SINGULAR * self.H.shape[1])

    def dilution(self, axes: Sequence[int] | None = None) -> FloatArray:
        """Return the root of the trace of (H'H)^-1, shape (epochs,); NaN where singular.

        The trace is over all columns or those named.
        """
        chosen = range(self.H.shape[2]) if axes is None else axes
        with np.errstate(divide="ignore"):
            inverse = np.where(self.is_singular[:, None], np.nan, 1.0 / self.eigenvalues)
        shares = (self.vectors[:, list(chosen)] ** 2).sum(axis=1)
        return np.asarray(np.sqrt((shares * inverse).sum(axis=1)))


def geometry_of(direction: FloatArray, axes: Sequence[Axis]) -> InformationModes:
    """Geometry from the directions (epochs, l, 3) to the sources of one aircraft.

    Examples
    --------
    >>> found = geometry_of(np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]), ("north", "east"))
    >>> found.determinant.tolist(), found.least_eigenvalue.tolist(), found.dilution().round(6).tolist()
    ([1.0], [1.0], [1.414214])
    """
    full = np.concatenate([direction, np.ones((*direction.shape[:2], 1))], axis=2)
    H = full[:, :, [COLUMN[axis] for axis in axes]]
    eigenvalues, vectors = np.linalg.eigh(np.swapaxes(H, 1, 2) @ H)
    return InformationModes(H, np.maximum(eigenvalues, 0.0), vectors)


def loss(geometry: InformationModes, criterion: LocalCriterion) -> FloatArray:
    """Return the quantity that a local criterion minimises at each epoch, shape (epochs,).

    Minus the determinant, minus the least eigenvalue, or the dilution; that is infinite where H'H is singular.
    """
    if criterion == "determinant":
        return -geometry.determinant
    if criterion == "eigenvalue":
        return -geometry.least_eigenvalue
    return np.nan_to_num(geometry.dilution(), nan=np.inf)


def loss_by_direction(geometry: InformationModes, criterion: LocalCriterion, axes: Sequence[Axis]) -> FloatArray:
    """Derivative of the loss by the directions, shape (epochs, l, 3); of a singular H'H zero.

    With A = H'H the derivative by H is 2 H times that by A: adj(A) of the determinant, n n' of the least eigenvalue
    with its vector n, -A^-2 / (2 dilution) of the dilution. Where the two least eigenvalues are equal that of the least
    is one of its one-sided derivatives.
    """
    values, vectors, known = geometry.eigenvalues, geometry.vectors, ~geometry.is_singular
    weights = np.zeros(values.shape)
    if criterion == "determinant":
        for column in range(values.shape[1]):
            weights[known, column] = -np.prod(np.delete(values[known], column, axis=1), axis=1)
    elif criterion == "eigenvalue":
        weights[:, 0] = -1.0
    else:
        weights[known] = -(values[known] ** -2.0) / (2.0 * geometry.dilution()[known, None])
    by_information = (vectors * weights[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    by_columns = 2.0 * geometry.H @ by_information
    found = np.zeros((*geometry.H.shape[:2], 4))
    found[:, :, [COLUMN[axis] for axis in axes]] = by_columns
    return found[:, :, :3]
