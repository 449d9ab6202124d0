"""Plots of the GNSS reception: states, quality, scatter, steps, two receivers."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from groundstation.chapters.plots.common import has_values, positive, span
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import AnyMark, Curve, Dots, Floats, Lanes, Limit, Role
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_gaps, finite, padded, symmetric
from groundstation.results.flight import FlightResults
from groundstation.systems.gnss.answer import STATE_NAMES, GnssReception
from groundstation.systems.gnss.arrays import GnssAveraging, GnssPairs, GnssQuality, GnssStandstill, GnssStates

ROLES: dict[str, Role] = {
    **dict.fromkeys(("rtk_fixed", "ppp", "dgnss", "3d", "gnss_ins", "fix"), "good"),
    **dict.fromkeys(("rtk_float", "2d", "other", "dead_reckoning"), "warn"),
    **dict.fromkeys(("integrity_lost", "none"), "bad"),
    **dict.fromkeys(("no_record", "log_silent", "not_logged"), "faint"),
}
ONE_ALONE = {  # axes that say which of two lines is there
    ("satellites", "used"): "satellites used",
    ("satellites", "tracked"): "satellites tracked",
    ("dilution", "HDOP"): "HDOP",
    ("dilution", "PDOP"): "PDOP",
    ("claimed σ, m", "horizontal"): "horizontal σ, m",
    ("claimed σ, m", "vertical"): "vertical σ, m",
}
PANEL_MM, LANE_MM = 24.0, 5.0
M_PER_CM = 0.01


def states(results: FlightResults) -> Plot | None:
    """Return the states of every receiver as lanes over flight time."""
    data = results.rows_of(GnssStates)
    if data is None or not len(data):
        return None
    topics = list(dict.fromkeys(data.topic.tolist()))
    ends = time_axis(*span(data.start_s, data.end_s))
    rows = []
    for topic in topics:
        mine = data.where(data.topic == topic)
        had = set(mine.state.tolist())
        order = (*(name for name in STATE_NAMES if name in had), *sorted(had - STATE_NAMES.keys()))
        names = tuple(STATE_NAMES.get(name, name) for name in order)
        lanes = Lanes(
            start=mine.start_s,
            end=mine.end_s,
            state=np.array([STATE_NAMES.get(name, name) for name in mine.state.tolist()]),
            order=names,
            roles={STATE_NAMES.get(name, name): ROLES.get(name, "other") for name in order},
        )
        panel = Panel(
            [lanes],
            ends,
            Axis(
                names=tuple((float(place), name) for place, name in enumerate(names)), low=len(names) - 0.5, high=-0.5
            ),
            title=topic if len(topics) > 1 else "",
            legend="",
        )
        rows.append(Row((panel,), 3.0 + LANE_MM * len(names), shares_x=topic != topics[-1]))
    return Plot(
        "gnss.states",
        "States of the fix",
        "A lane for each state that the receiver was in.",
        "States of the fix over flight time, a lane each.",
        tuple(rows),
        ("gnss_states",),
    )


def _of(results: FlightResults, topic: str) -> str:
    """Return the name of a receiver behind a title, where there are several."""
    answer = results.answer(GnssReception)
    return f" of {topic}" if answer is not None and len(answer.receivers) > 1 else ""


def quality(results: FlightResults, topic: str) -> Plot | None:
    """Return satellites, C/N0, dilution, claimed sigmas, age of corrections of a receiver."""
    data = results.rows_of(GnssQuality)
    if data is None:
        return None
    mine = data.where(data.topic == topic)
    panels: tuple[tuple[str, tuple[tuple[str, Floats, Role], ...]], ...] = (
        ("satellites", (("used", mine.satellites_used, "gnss"), ("tracked", mine.satellites_tracked, "series 1"))),
        ("C/N0, dB-Hz", (("C/N0", mine.cn0_dbhz, "gnss"),)),
        ("dilution", (("HDOP", mine.hdop, "gnss"), ("PDOP", mine.pdop, "series 1"))),
        (
            "claimed σ, m",
            (("horizontal", mine.horizontal_sigma_m, "gnss"), ("vertical", mine.vertical_sigma_m, "series 1")),
        ),
        ("velocity σ, m/s", (("velocity", mine.velocity_sigma_mps, "gnss"),)),
        ("correction age, s", (("age", mine.age_of_corrections_s, "gnss"),)),
    )
    shown = [(title, [line for line in lines if has_values(line[1])]) for title, lines in panels]
    shown = [(title, lines) for title, lines in shown if lines]
    if not shown:
        return None
    ends = time_axis(*span(mine.time_s))
    rows = []
    for title, lines in shown:
        marks = []
        for name, values, role in lines:
            x, y = broken_at_gaps(mine.time_s, values)
            marks.append(Curve(x=x, y=y, role=role, name=name if len(lines) > 1 else ""))
        axis = ONE_ALONE.get((title, lines[0][0]), title) if len(lines) == 1 else title
        most = finite(*(values for _name, values, _role in lines))
        panel = Panel(marks, ends, Axis(axis, low=_low(title, most), high=_high(most)), legend=_legend(lines))
        rows.append(Row((panel,), PANEL_MM, shares_x=title != shown[-1][0]))
    return Plot(
        f"gnss.quality.{topic}",
        f"Satellites, signals and claimed accuracy{_of(results, topic)}",
        "As the receiver states them: σ as it claims it, age of the corrections. What it does not log is left out. A "
        "few high values may leave a panel.",
        "Satellites, signal strength, dilution and claimed sigmas over flight time.",
        tuple(rows),
        ("gnss_quality",),
    )


def _legend(lines: list[tuple[str, Floats, Role]]) -> Literal["above", ""]:
    return "above" if len(lines) > 1 else ""


def _low(title: str, values: Floats) -> float:
    return padded(float(values.min()), float(values.max()), 0.1)[0] if title.startswith("C/N0") else 0.0


def _high(values: Floats) -> float:
    """Return the upper end of an axis: a few far values may leave it."""
    most = float(values.max())
    usual = float(np.quantile(values, 0.99))
    return 1.1 * (most if most < 3.0 * usual else usual) or 1.0


def standstill(results: FlightResults, topic: str) -> Plot | None:
    """Return places at standstill in the plane, and the scatter of longer and longer means."""
    data, means, answer = results.rows_of(GnssStandstill), results.rows_of(GnssAveraging), results.answer(GnssReception)
    if data is None or answer is None:
        return None
    mine = data.where(data.topic == topic)
    one = next((one for one in answer.receivers if one.topic == topic), None)
    stood = None if one is None else one.told_standstill
    if not len(mine) or one is None or stood is None or stood.is_held:
        return None
    kind = f" while {STATE_NAMES.get(stood.state, stood.state)}" if len(one.fixes) > 1 else ""
    scale, unit = (1.0 / M_PER_CM, "cm") if stood.scatter_m < 0.5 else (1.0, "m")
    reach = symmetric(scale * finite(mine.north_m, mine.east_m), 0.1)
    plane: list[AnyMark] = [Dots(x=scale * mine.east_m, y=scale * mine.north_m, role="gnss", name="positions")]
    if stood.claimed_m is not None:
        angle = np.linspace(0.0, 2.0 * np.pi, 91)
        radius = scale * stood.claimed_m / np.sqrt(2.0)
        reach = symmetric([*reach, radius], 0.1)
        plane.append(
            Curve(x=radius * np.cos(angle), y=radius * np.sin(angle), role="limit", name="σ claimed", dash="dashed")
        )
    side = Panel(
        plane,
        Axis(f"east, {unit}", low=reach[0], high=reach[1]),
        Axis(f"north, {unit}", low=reach[0], high=reach[1]),
        is_map=True,
        share=1.0,
    )
    panels = [side]
    if means is not None and np.count_nonzero(means.topic == topic) > 1:
        panels.append(_averaging(means.where(means.topic == topic), stood.claimed_m, scale, unit))
    return Plot(
        f"gnss.standstill.{topic}",
        f"Scatter at standstill{kind}{_of(results, topic)}",
        "Left: positions about their mean, and the σ claimed along each axis. Right: scatter of means over a time. "
        "Errors without memory fall along the grey line; where the dots stay above it, errors last, and the scatter "
        "of a short standstill understates them.",
        "Positions at standstill, and the scatter of means over longer and longer times.",
        (Row(tuple(panels), 62.0),),
        ("gnss_standstill", "gnss_averaging"),
    )


def _averaging(means: GnssAveraging, claimed_m: float | None, scale: float, unit: str) -> Panel:
    x = means.averaged_s
    marks: list[AnyMark] = [
        Curve(x=x, y=positive(scale * means.without_memory_m), role="faint", name="without memory"),
        Curve(x=x, y=positive(scale * means.scatter_m), role="gnss", name="scatter of means"),
        Dots(x=x, y=positive(scale * means.scatter_m), role="gnss", emphasis="bold"),
    ]
    if claimed_m is not None and claimed_m > 0.0:
        marks.append(Limit(value=scale * claimed_m, name="σ claimed"))
    return Panel(marks, Axis("averaged over, s", "log"), Axis(f"scatter, {unit}", "log"), share=1.3)


def steps(results: FlightResults, topic: str) -> Plot | None:
    """Return the steps of the position beyond the velocity over flight time."""
    data = results.rows_of(GnssQuality)
    if data is None:
        return None
    mine = data.where(data.topic == topic)
    if not has_values(mine.position_step_m):
        return None
    known = finite(mine.position_step_m)
    marks = [Dots(x=mine.time_s, y=mine.position_step_m, role="gnss")]
    y = Axis("step beyond velocity, m", low=0.0, high=1.08 * max(float(known.max()), 1e-3))
    return Plot(
        f"gnss.steps.{topic}",
        f"Steps of the position{_of(results, topic)}",
        "Size of each step of the position less the one that the velocity gives, its delay taken off; without "
        "velocities, less the step before it. A jump stands out.",
        "Steps of the position beyond the velocity over flight time.",
        one_panel(Panel(marks, time_axis(*span(mine.time_s)), y, legend=""), PANEL_MM),
        ("gnss_quality",),
    )


def pair(results: FlightResults, name: str) -> Plot | None:
    """Return second receiver minus first: place and velocity."""
    data = results.rows_of(GnssPairs)
    if data is None:
        return None
    mine = data.where(data.pair == name)
    if not len(mine):
        return None
    ends = time_axis(*span(mine.time_s))
    groups: tuple[tuple[str, tuple[tuple[str, Floats, Role], ...]], ...] = (
        (
            "apart, m",
            (
                ("north", mine.north_m, "series 1"),
                ("east", mine.east_m, "series 2"),
                ("up", mine.up_m, "series 3"),
                ("in the plane", mine.distance_m, "ink"),
            ),
        ),
        ("velocity, m/s", (("north", mine.north_mps, "series 1"), ("east", mine.east_mps, "series 2"))),
    )
    shown = [(title, [line for line in lines if has_values(line[1])]) for title, lines in groups]
    shown = [(title, lines) for title, lines in shown if lines]
    rows = []
    for title, lines in shown:
        marks: list[AnyMark] = [ZERO]
        for label, values, role in lines:
            x, y = broken_at_gaps(mine.time_s, values)
            marks.append(Curve(x=x, y=y, role=role, name=label))
        rows.append(Row((Panel(marks, ends, Axis(title)),), 30.0, shares_x=title != shown[-1][0]))
    return Plot(
        f"gnss.pair.{name}",
        name,
        "Second receiver minus the first at the times of the first. Of two antennas on one vehicle the distance in the "
        "plane stays the same.",
        "Place and velocity of the second receiver from the first over flight time.",
        tuple(rows),
        ("gnss_pairs",),
    )


PLOTS: Mapping[str, Describe] = {
    "gnss.states": states,
    "gnss.quality": quality,
    "gnss.standstill": standstill,
    "gnss.steps": steps,
    "gnss.pair": pair,
}
