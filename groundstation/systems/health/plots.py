"""Plots of autopilot health: lanes of the checks, quantities against limits."""

from collections.abc import Iterator, Mapping

import numpy as np

from groundstation.base.words import capitalised
from groundstation.chapters.plots.common import label, span
from groundstation.chapters.wording import unit_sign
from groundstation.plots.axes import broken_time_axis, time_axis
from groundstation.plots.marks import AnyMark, Curve, Lanes, Limit, Role, Spans, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row
from groundstation.plots.ranges import broken_at_gaps
from groundstation.results.flight import FlightResults
from groundstation.systems.health.answer import AutopilotHealth, Check, Measure
from groundstation.systems.health.arrays import HealthLanes, HealthMotors, HealthSeries

LANE_MM, PANEL_MM = 5.2, 26.0
MOST_CURVES = 7
ROLES: Mapping[str, Role] = {"good": "good", "amber": "warn", "red": "bad", "not logged": "unused"}
SIGNS: Mapping[str, str] = {"m/s2": "m/s²", "rad2": "rad²"}


def lanes(results: FlightResults) -> Plot | None:
    """Return the grade of each check over time, a lane each."""
    answer, data = results.answer(AutopilotHealth), results.rows_of(HealthLanes)
    if answer is None or data is None:
        return None
    order = tuple(one.title for one in answer.checks if np.any(data.check == one.title))
    marks = []
    for grade, role in ROLES.items():
        own = data.where(data.grade == grade)
        if len(own):
            marks.append(Lanes(start=own.start_s, end=own.end_s, state=own.check, order=order, role=role, name=grade))
    panel = Panel(marks, time_axis(*_whole(results, data)), legend="")
    return Plot(
        "health.lanes",
        "Checks over time",
        "Green: within limits, orange: amber, red: beyond the red limit, or a message of that grade. "
        "Grey: the log pauses. White: none.",
        "A lane for each check of the autopilot over flight time, coloured by grade.",
        (Row((panel,), LANE_MM * max(len(order), 1)),),
        ("health_lanes",),
    )


def _whole(results: FlightResults, data: HealthLanes) -> tuple[float, float]:
    low, high = span(data.start_s, data.end_s)
    return min(low, 0.0), max(high, results.duration_s)


def panels(results: FlightResults, key: str) -> Plot | None:
    """Return the quantities of a check against their limits, a panel each.

    None where none is a curve.
    """
    answer, data = results.answer(AutopilotHealth), results.rows_of(HealthSeries)
    if answer is None or data is None:
        return None
    check = next((one for one in answer.checks if one.key == key), None)
    drawn = [] if check is None else list(_panels(answer, check, data))
    if check is None or not drawn:
        return None
    lane = results.rows_of(HealthLanes)
    axis = time_axis(*span(data.time_s)) if lane is None else time_axis(*_whole(results, lane))
    rows = tuple(
        Row((Panel(marks, axis, y, title=title),), PANEL_MM, shares_x=place + 1 < len(drawn))
        for place, (title, y, marks) in enumerate(drawn)
    )
    return Plot(
        f"health.panels.{key}",
        capitalised(check.title),
        "The worst value of each short span; broken lines: amber and red limits.",
        f"{check.title} over flight time.",
        rows,
        ("health_series",),
    )


def motors(results: FlightResults) -> Plot | None:
    """Return the outputs to the motors around the loss of attitude; None without one."""
    answer, data = results.answer(AutopilotHealth), results.rows_of(HealthMotors)
    if answer is None or answer.loss is None or data is None or not answer.loss.motors:
        return None
    loss = answer.loss
    end_s = loss.start_s + loss.judged_s
    marks: list[AnyMark] = [
        Spans(
            start=np.array([loss.start_s]),
            end=np.array([end_s]),
            kind=np.array(["judged"]),
            role="unused",
            name="judged after the loss",
        )
    ]
    for place, number in enumerate(np.unique(data.output).tolist()):
        own = data.where(data.output == number)
        x, y = broken_at_gaps(own.time_s, own.value)
        marks.append(Curve(x=x, y=y, role=series(place), name=f"output {number}"))
    low, high = min(one.low for one in loss.motors), max(one.high for one in loss.motors)
    marks += [
        Limit(value=value, role="bad", label=name, emphasis="thin")
        for value, name in ((low, "lowest"), (high, "highest"))
    ]
    room = 0.08 * (high - low)
    known = data.value[np.isfinite(data.value)]
    axis = Axis(
        f"output, {loss.unit}" if loss.unit else "output", low=min(low, *known) - room, high=max(high, *known) + room
    )
    return Plot(
        "health.motors",
        "Motor outputs around the loss of attitude",
        "What each motor was commanded; broken lines: lowest and highest output in flight.",
        "Outputs to the motors over flight time around the loss of control of attitude.",
        (Row((Panel(marks, broken_time_axis([span(data.time_s)]), axis),), 2.0 * PANEL_MM),),
        ("health_motors",),
    )


def sign_of(unit: str) -> str:
    """Return the sign of a unit."""
    return SIGNS.get(unit) or unit_sign(unit)


def _panels(answer: AutopilotHealth, check: Check, data: HealthSeries) -> Iterator[tuple[str, Axis, list[AnyMark]]]:
    """Yield title, upright axis and marks of each quantity of a check."""
    places = {id(one): place for place, one in enumerate(answer.measures)}
    for quantity in dict.fromkeys(one.quantity for one in check.measures):
        own = [one for one in check.measures if one.quantity == quantity]
        marks: list[AnyMark] = []
        for number, one in enumerate(own[:MOST_CURVES]):
            rows = data.where(data.measure == places[id(one)])
            if len(rows) and np.isfinite(rows.value).any():
                x, y = broken_at_gaps(rows.time_s, rows.value)
                marks.append(Curve(x=x, y=y, role=series(number), name=label(one.sensor or one.title)))
        if marks:
            shown = data.value[np.isin(data.measure, [places[id(one)] for one in own])]
            limits = list(_limits(own[0], shown))
            title = capitalised(own[0].title)
            yield title, _upright(shown, limits, sign_of(own[0].unit)), [*marks, *limits]


def _upright(value: np.ndarray, limits: list[Limit], unit: str) -> Axis:
    """Return the upright axis: from zero where nothing is negative."""
    top = max([float(np.nanmax(value)), *(one.value for one in limits)])
    if float(np.nanmin(value)) < 0.0:
        return Axis(unit)
    return Axis(unit, low=0.0, high=1.08 * top if top > 0.0 else 1.0)


def _limits(measure: Measure, value: np.ndarray) -> Iterator[Limit]:
    """Yield the limits that are near what was measured: one far off would flatten the curve."""
    known = value[np.isfinite(value)]
    reach = float(np.max(np.abs(known))) if known.size else 0.0
    for level, name, role in ((measure.amber, "amber", "warn"), (measure.red, "red", "bad")):
        if level is not None and measure.rule != "rise" and abs(level) <= 3.0 * reach:
            yield Limit(value=level, role="warn" if role == "warn" else "bad", label=name, emphasis="thin")


PLOTS: Mapping[str, Describe] = {"health.lanes": lanes, "health.panels": panels, "health.motors": motors}
