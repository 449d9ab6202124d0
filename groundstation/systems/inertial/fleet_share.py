"""Share of a flight in the fleet: skill of the forecast, and figures of each INS."""

import math

from groundstation.results.files import SavedFlight
from groundstation.results.fleet_share import SkillOfFlight, SystemShare, to_number
from groundstation.systems.inertial.fleet_units_share import units_of
from groundstation.systems.inertial.forecast_answer import TOO_FEW, WITHIN, CalibrationRow, ForecastResult, honesty
from groundstation.systems.system import InFleet


def share_of(saved: SavedFlight) -> SystemShare:
    """Return the forecast skill of a flight, its shipped method and its INS units."""
    forecast, units = saved.results.answer(ForecastResult), units_of(saved)
    if forecast is None:
        return SystemShare(units=units)
    told = {(row.method, row.horizon_min): _is_within(row) for row in forecast.calibration}
    rows = [
        SkillOfFlight(
            *(row.method, row.horizon_min, row.starts, row.rms_m, to_number(row.coverage95)),
            is_within=told.get((row.method, row.horizon_min)),
        )
        for row in forecast.skill
        if row.starts >= 1 and math.isfinite(to_number(row.horizon_min) + to_number(row.rms_m))
    ]
    return SystemShare(shipped=forecast.default_method, skill=rows, units=units)


def _is_within(row: CalibrationRow) -> bool | None:
    """Tell whether NEES is within its limits.

    None when there are too few starts, or the row is damaged on the disk.
    """
    figures = [to_number(value) for value in (row.independent_starts, row.nees, row.nees_low, row.nees_high)]
    if not all(map(math.isfinite, figures)):
        return None
    says = honesty(int(figures[0]), *figures[1:])
    return None if says == TOO_FEW else says == WITHIN


IN_FLEET = InFleet(share=share_of)
