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
SENSORS = ("magnetic", "flux")  # first part of their columns
SURE = 3  # A to C, which a fit shows or is none; D and E may be open


def deviations(flights: FigureData) -> tuple[FleetDeviationRow, ...]:
    """Compare each flight that found a deviation with the mean of its aircraft's others.

    The difference of two curves A + B sin c + C cos c + D sin 2c + E cos 2c is told as its RMS over the circle, with
    the RMS that the sigmas of both lead to expect where nothing changed; a D or E that one of them does not show is
    left out. Flights with the verdict reject are not compared, nor those whose log names no aircraft, nor a
    magnetometer with a flux valve.

    Parameters
    ----------
    flights : FigureData
        The table of flights; see :class:`groundstation.results.fleet.FleetResults`.

    Returns
    -------
    tuple of DeviationRow
        By sensor, aircraft, then time (flights without one first), then flight id.
    """
    return tuple(row for sensor in SENSORS for row in _of_sensor(flights, sensor))


def _of_sensor(flights: FigureData, sensor: str) -> list[FleetDeviationRow]:
    values, sigmas = (
        np.column_stack([flights[f"{sensor}_{letter.lower()}{end}_deg"] for letter in LETTERS])
        for end in ("", "_sigma")
    )
    known = np.isfinite(values[:, :SURE]).all(axis=1) & np.isfinite(sigmas[:, :SURE]).all(axis=1)
    aircraft, verdict = flights["aircraft"], flights[f"{sensor}_verdict"]
    is_compared = known & (verdict != NOT_COMPARED) & (aircraft != "")
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
                verdict=str(verdict[row]),
                method=str(flights[f"{sensor}_method"][row]),
                coefficients_deg=dict(zip(LETTERS, values[row].tolist(), strict=True)),
                coefficients_sigma_deg=dict(zip(LETTERS, sigmas[row].tolist(), strict=True)),
                before_rms_deg=_known(flights[f"{sensor}_before_rms_deg"][row]),
                after_rms_deg=_known(flights[f"{sensor}_after_rms_deg"][row]),
                others=len(others),
                difference_rms_deg=difference,
                expected_rms_deg=expected,
                sensor=sensor,
            )
        )
    return found


def _difference(
    own: FloatArray, sigma: FloatArray, others: FloatArray, other_sigmas: FloatArray
) -> tuple[float | None, float | None]:
    if not len(others):
        return None, None
    steps = own - others
    steps[:, 0] = wrap_180(steps[:, 0])
    known = np.isfinite(steps) & np.isfinite(sigma + other_sigmas)
    count = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, steps, 0.0).sum(axis=0) / count
    variance = np.where(known, other_sigmas, 0.0) ** 2
    total = np.where(known.any(axis=0), sigma**2 + variance.sum(axis=0) / count**2, 0.0)
    return float(np.sqrt(OVER_CIRCLE @ mean**2)), float(np.sqrt(OVER_CIRCLE @ total))


def _time(flights: FigureData, row: int) -> int | None:
    start = flights["start_utc"][row]
    return None if np.isnat(start) else int(start.astype("datetime64[ns]").astype(np.int64))


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
