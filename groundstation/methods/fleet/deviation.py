"""Magnetic deviation of an aircraft over its flights, to show changes by load or repair."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.methods.harmonics import OVER_CIRCLE
from groundstation.results.figures import FigureData
from groundstation.results.fleet import FleetDeviationRow
from groundstation.results.roles import LETTERS

FloatArray = NDArray[np.float64]
NOT_COMPARED = "reject"


def deviations(flights: FigureData) -> tuple[FleetDeviationRow, ...]:
    """Compare each flight that found its deviation with the mean of its aircraft's others.

    The difference of two curves A + B sin c + C cos c + D sin 2c + E cos 2c is told as its RMS over the circle, with
    the RMS that the sigmas of both lead to expect where nothing changed. Flights with the verdict reject are not
    compared, nor those whose log names no aircraft.

    Parameters
    ----------
    flights : FigureData
        The table of flights; see :class:`groundstation.results.fleet.FleetResults`.

    Returns
    -------
    tuple of DeviationRow
        By aircraft, then time (flights without one first), then flight id.
    """
    values, sigmas = (
        np.column_stack([flights[f"magnetic_{letter.lower()}{end}_deg"] for letter in LETTERS])
        for end in ("", "_sigma")
    )
    known = np.isfinite(values).all(axis=1) & np.isfinite(sigmas).all(axis=1)
    aircraft = flights["aircraft"]
    is_compared = known & (flights["magnetic_verdict"] != NOT_COMPARED) & (aircraft != "")
    rows = np.flatnonzero(known).tolist()
    rows.sort(key=lambda row: (str(aircraft[row]), _time(flights, row) or 0, str(flights["flight_id"][row])))
    found = []
    for row in rows:
        others = np.flatnonzero(is_compared & (aircraft == aircraft[row])) if is_compared[row] else np.zeros(0, int)
        others = others[others != row]
        difference, expected = _difference(values[row], sigmas[row], values[others], sigmas[others])
        found.append(
            FleetDeviationRow(
                aircraft=str(aircraft[row]),
                flight_id=str(flights["flight_id"][row]),
                start_utc_ns=_time(flights, row),
                verdict=str(flights["magnetic_verdict"][row]),
                method=str(flights["magnetic_method"][row]),
                coefficients_deg=dict(zip(LETTERS, values[row].tolist(), strict=True)),
                coefficients_sigma_deg=dict(zip(LETTERS, sigmas[row].tolist(), strict=True)),
                before_rms_deg=_known(flights["magnetic_before_rms_deg"][row]),
                after_rms_deg=_known(flights["magnetic_after_rms_deg"][row]),
                others=len(others),
                difference_rms_deg=difference,
                expected_rms_deg=expected,
            )
        )
    return tuple(found)


def _difference(
    own: FloatArray, sigma: FloatArray, others: FloatArray, other_sigmas: FloatArray
) -> tuple[float | None, float | None]:
    if not len(others):
        return None, None
    steps = own - others
    steps[:, 0] = wrap_180(steps[:, 0])
    variance = sigma**2 + np.sum(other_sigmas**2, axis=0) / len(others) ** 2
    return float(np.sqrt(OVER_CIRCLE @ np.mean(steps, axis=0) ** 2)), float(np.sqrt(OVER_CIRCLE @ variance))


def _time(flights: FigureData, row: int) -> int | None:
    start = flights["start_utc"][row]
    return None if np.isnat(start) else int(start.astype("datetime64[ns]").astype(np.int64))


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
