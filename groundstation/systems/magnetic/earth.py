"""The earth's field where the figure was flown: of the model of its date, or as stated."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, mean_heading, wrap_180
from groundstation.base.declination import Declination, declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.systems.magnetic.answer import DeclinationUsed
from groundstation.systems.magnetic.poisson import EarthField
from groundstation.systems.magnetic.readings import ANALYSIS, NO_DATE, PLACE_WANTED, Readings
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.table import Flight


def earth_field(
    flight: Flight, readings: Readings, rows: NDArray[np.intp], settings: MagneticSettings
) -> tuple[FloatArray, DeclinationUsed, EarthField]:
    """Return declination at every reading, and declination and field of the figure.

    The first has shape (n,), the others are those in the middle of the figure, ``rows``.

    Raises
    ------
    NotAssessableError
        No date, no position, or a date no model serves, and no ``declination_deg`` in the settings.
    """
    stated = settings.declination_deg
    try:
        model = _modelled(flight, readings, rows)
    except NotAssessableError:
        if stated is None:
            raise
        return _without_model(readings, rows, stated, settings)
    values = mean_heading(model.values_deg[rows])
    horizontal, down = (float(np.nanmean(part[rows])) for part in (model.horizontal_nt, model.down_nt))
    earth = EarthField(float(wrap_180(values)), horizontal, down)
    used = DeclinationUsed(
        earth.declination_deg, float(np.nanmean(model.sigma_deg[rows])), model.model, horizontal, down
    )
    along = np.where(np.isfinite(model.values_deg), model.values_deg, earth.declination_deg)
    if stated is None:
        return along, used, earth
    change = wrap_180(along - earth.declination_deg)
    used = replace(used, value_deg=stated, sigma_deg=settings.declination_sigma_deg, model="as stated")
    return wrap_180(stated + change), used, replace(earth, declination_deg=stated)


def _modelled(flight: Flight, readings: Readings, rows: NDArray[np.intp]) -> Declination:
    if not flight.has_utc:
        raise NotAssessableError(ANALYSIS, *NO_DATE)
    if not np.isfinite(readings.latitude_deg[rows]).any():
        raise NotAssessableError(ANALYSIS, "no position at the figure", PLACE_WANTED)
    return declination_along(readings.latitude_deg, readings.longitude_deg, readings.altitude_m, int(flight.start_ns))


def _without_model(
    readings: Readings, rows: NDArray[np.intp], stated: float, settings: MagneticSettings
) -> tuple[FloatArray, DeclinationUsed, EarthField]:
    """Take the strength from the readings: their median.

    The strength matters to nothing but the unit of the iron.
    """
    strength = float(np.median(np.linalg.norm(readings.field_nt[rows], axis=1)))
    used = DeclinationUsed(stated, settings.declination_sigma_deg, "as stated")
    return np.full(len(readings), stated), used, EarthField(stated, strength, 0.0, is_modelled=False)
