"""Plots of the INS errors and of the forecast of two flights over each other."""

from collections.abc import Sequence

from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import has_values, label, positive
from groundstation.chapters.plots.comparison import Compared, Overlay, PlottedSide, TimeLine, overlaid
from groundstation.plots.marks import Curve, Dash, Emphasis
from groundstation.plots.plot import Axis, Panel, Plot, one_panel
from groundstation.systems.inertial.arrays import InertialStates, InertialTrack
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.forecast_arrays import ForecastGrowth
from groundstation.systems.inertial.forecast_chapter import short


def _radial(data: InertialTrack) -> TimeLine:
    return TimeLine(data.time_s, data.ins_error_m)


def _north(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.north.position_m, NORMAL_95 * data.north.position_sigma_m)


def _east(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.east.position_m, NORMAL_95 * data.east.position_sigma_m)


def _north_velocity(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.north.velocity_mps, NORMAL_95 * data.north.velocity_sigma_mps)


def _east_velocity(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.east.velocity_mps, NORMAL_95 * data.east.velocity_sigma_mps)


def growth(sides: Sequence[PlottedSide]) -> Plot | None:
    """Return the RMS of the forecast by horizon, the shipped method and the INS without one."""
    marks = []
    for side in sides:
        data = side.flight.rows_of(ForecastGrowth)
        for method in (_default_method(side), "raw_ins"):
            rms_m = None if data is None else data.rms_m.get(method)
            if data is None or rms_m is None or not has_values(rms_m):
                continue
            name = f"{side.letter}: {label(short(method))}"
            is_raw = method == "raw_ins"
            dash: Dash = "dotted" if is_raw else ""
            heavy: Emphasis = "thin" if is_raw else side.emphasis
            x, y = data.horizon_min, positive(rms_m)
            marks.append(Curve(x=x, y=y, role=side.role, name=name, dash=dash, emphasis=heavy))
    if not marks:
        return None
    return Plot(
        "comparison.growth",
        "Forecast",
        "Root mean square of the radial error over all replayed starts; dotted: the INS without a forecast.",
        "RMS of the forecast error of A and B by horizon.",
        one_panel(Panel(marks, Axis("horizon, min", "log"), Axis("RMS radial error, m", "log")), 52.0),
    )


def _default_method(side: PlottedSide) -> str:
    forecast = side.flight.results.answer(ForecastResult)
    return "" if forecast is None else forecast.default_method


COMPARED = Compared(
    "inertial",
    "INS errors",
    overlaid(
        Overlay(InertialTrack, "ins_error_m", _radial, "radial error, m", "Radial error of the INS against GNSS"),
        Overlay(InertialStates, "north_position_m", _north, "north position error, m", "North position error"),
        Overlay(InertialStates, "east_position_m", _east, "east position error, m", "East position error"),
        Overlay(
            InertialStates, "north_velocity_mps", _north_velocity, "north velocity error, m/s", "North velocity error"
        ),
        Overlay(InertialStates, "east_velocity_mps", _east_velocity, "east velocity error, m/s", "East velocity error"),
    ),
    (
        ("inertial_states-north_position_m", "inertial_states-east_position_m"),
        ("inertial_states-north_velocity_mps", "inertial_states-east_velocity_mps"),
        ("inertial_track-ins_error_m",),
    ),
)
COMPARED_FORECAST = Compared("forecast", "Forecast", {"growth": growth}, (("growth",),))
