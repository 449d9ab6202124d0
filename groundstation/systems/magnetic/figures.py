"""Arrays behind the figures of the magnetic chapter."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.records import BoolArray
from groundstation.methods import harmonics
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import Method, MethodName
from groundstation.systems.magnetic.apply import corrected_by_table
from groundstation.systems.magnetic.arrays import (
    BodyField,
    MagneticCurves,
    MagneticField,
    MagneticModulus,
    MagneticSamples,
    MagneticTable,
)
from groundstation.systems.magnetic.compass_table import CENTRES_DEG
from groundstation.systems.magnetic.manoeuvre import OppositeTurns
from groundstation.systems.magnetic.poisson import corrected_heading_deg
from groundstation.systems.magnetic.readings import Readings
from groundstation.systems.magnetic.three_methods import Fits

LARGEST = 20_000  # readings drawn: of more, every k-th
MOST_VECTORS = 4_000  # of the field


def draw(
    readings: Readings,
    declination_deg: FloatArray,
    part: NDArray[np.str_],
    figures: list[OppositeTurns],
    fits: Fits,
    deviation_deg: FloatArray,
    methods: Sequence[Method],
    recommended: tuple[MethodName, FloatArray],
) -> tuple[FigureData, ...]:
    """Return readings with their errors, the table, deviations, modulus and field.

    The deviation is by each method. ``recommended``: the method to correct by, and its deviation in each bin, shape
    (360,).
    """
    return (
        _samples(readings, declination_deg, part, fits, deviation_deg),
        _table(fits, deviation_deg),
        _curves(methods, *recommended),
        _modulus(readings, figures, fits),
        _field(readings, part, fits),
    )


def parts_of(is_airborne: BoolArray, is_held_out: BoolArray, figures: list[OppositeTurns]) -> NDArray[np.str_]:
    """Part of the flight each reading belongs to, shape (n,)."""
    part = np.where(is_airborne, "other flight", "ground").astype("U12")
    part[is_held_out] = "held out"
    for figure in figures:
        part[figure.rows(True)], part[figure.rows(False)] = "right turn", "left turn"
    return part


def _samples(
    readings: Readings,
    declination_deg: FloatArray,
    part: NDArray[np.str_],
    fits: Fits,
    deviation_deg: FloatArray,
) -> MagneticSamples:
    kept = slice(None, None, max(1, -(-len(readings) // LARGEST)))
    shown, drawn = readings.take(kept), part[kept]
    expected = shown.true_heading_deg - declination_deg[kept]
    heading = shown.magnetic_heading_deg
    attitude, modulus = (
        np.full(len(shown), np.nan) if fit.reason else wrap_180(corrected_heading_deg(fit.iron, shown) - expected)
        for fit in (fits.attitude, fits.modulus)
    )
    return MagneticSamples(
        time_s=shown.time_s,
        part=drawn,
        bank_deg=shown.roll_deg,
        uncorrected_magnetic_heading_deg=heading,
        compass_error_deg=shown.compass_error_deg,
        error_before_deg=wrap_180(heading - expected),
        error_compass_table_deg=wrap_180(corrected_by_table(heading, deviation_deg) - expected),
        error_poisson_attitude_deg=attitude,
        error_constant_modulus_deg=modulus,
    )


def _table(fits: Fits, deviation_deg: FloatArray) -> MagneticTable:
    table = fits.table
    return MagneticTable(
        uncorrected_magnetic_heading_deg=CENTRES_DEG,
        right_turn_deg=table.right_deg,
        left_turn_deg=table.left_deg,
        compass_error_deg=table.average_deg,
        is_interpolated=~table.is_measured,
        fitted_error_deg=wrap_180(table.curve_deg),
        deviation_deg=deviation_deg,
        bank_bias_deg=fits.bias_deg,
    )


def _curves(methods: Sequence[Method], recommended: MethodName, recommended_deg: FloatArray) -> MagneticCurves:
    """Return the deviation in level flight and its sigma, by each method's A to E.

    The recommended one is given as it is applied, too. The modulus is drawn without A.
    """
    deviation_deg, sigma_deg = dict[str, FloatArray](), dict[str, FloatArray]()
    design = harmonics.design(CENTRES_DEG)
    for row in methods:
        values, sigma = (
            np.array([of.get(letter, 0.0 if of else np.nan) for letter in LETTERS])
            for of in (row.coefficients_deg, row.coefficients_sigma_deg)
        )
        deviation_deg[row.name], sigma_deg[row.name] = -(design @ values), np.sqrt(design**2 @ sigma**2)
    return MagneticCurves(
        uncorrected_magnetic_heading_deg=CENTRES_DEG,
        deviation_deg=deviation_deg,
        sigma_deg=sigma_deg,
        deviation_to_add_deg=recommended_deg,
        deviation_sigma_deg=sigma_deg[recommended],
    )


def _modulus(readings: Readings, figures: list[OppositeTurns], fits: Fits) -> MagneticModulus:
    rows = np.unique(np.concatenate([figure.rows(right) for figure in figures for right in (True, False)]))
    rows = rows[:: max(1, -(-len(rows) // LARGEST))]
    shown = readings.take(rows)
    attitude, modulus = (
        np.full((len(shown), 3), np.nan) if fit.reason else fit.iron.field_nt(shown.field_nt, shown.current_a)
        for fit in (fits.attitude, fits.modulus)
    )
    return MagneticModulus(
        time_s=shown.time_s,
        before_nt=np.linalg.norm(shown.field_nt, axis=1),
        poisson_attitude_nt=np.linalg.norm(attitude, axis=1),
        constant_modulus_nt=np.linalg.norm(modulus, axis=1),
    )


def _field(readings: Readings, part: NDArray[np.str_], fits: Fits) -> MagneticField:
    """Return the field along the body axes in flight, as read and freed of the fitted iron.

    NaN where none is fitted.
    """
    rows = np.flatnonzero(part != "ground")
    rows = rows[:: max(1, -(-len(rows) // MOST_VECTORS))]
    shown, fit = readings.take(rows), fits.attitude
    freed = np.full((len(shown), 3), np.nan) if fit.reason else fit.iron.field_nt(shown.field_nt, shown.current_a)
    before, after = (
        BodyField(forward_nt=values[:, 0], right_nt=values[:, 1], down_nt=values[:, 2])
        for values in (shown.field_nt, freed)
    )
    return MagneticField(time_s=shown.time_s, part=part[rows], before=before, after=after)
