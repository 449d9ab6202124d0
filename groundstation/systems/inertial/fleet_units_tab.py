"""Tab of the recording of a fleet: the INS units by serial."""

from dataclasses import replace

import rerun.blueprint as rrb

from groundstation.plots.marks import AnyMark, Band, Bars, Curve
from groundstation.plots.plot import Panel
from groundstation.results.fleet import FleetResults
from groundstation.systems.inertial.fleet_units_chapter import build, serial_name, shown
from groundstation.systems.inertial.fleet_units_plots import MOST_PANELS, chart
from groundstation.viewer.fleet_charts import BY_NUMBER
from groundstation.viewer.fleet_recorder import FleetRecorder
from groundstation.viewer.fleet_text import text_of
from groundstation.viewer.names import path_parts
from groundstation.viewer.plot_views import over_time
from groundstation.viewer.views import document


def units(recorder: FleetRecorder, fleet: FleetResults) -> rrb.Container | None:
    """Log the rate of each unit by the number of the flight, and the chapter.

    Returns the layout, None where no flight states a serial.
    """
    told = build(fleet)
    if told is None:
        return None
    recorder.document("units/answer", text_of(told))
    rows = shown(fleet, MOST_PANELS)
    names = path_parts([one.ins_serial for one in rows])
    views = [
        over_time(
            recorder,
            f"units/{name}",
            _with_ends(chart(fleet, one, BY_NUMBER, recorder.places)),
            f"{serial_name(one.ins_serial)}: rate, nmi/h",
        )
        for one, name in zip(rows, names, strict=True)
    ]
    text = document("INS units by serial", "units/answer")
    if not views:
        return rrb.Horizontal(contents=[text], name="INS units")
    grid = rrb.Grid(contents=views, grid_columns=1 if len(views) < 4 else 2)
    return rrb.Horizontal(contents=[grid, text], column_shares=[1.0, 1.0], name="INS units")


def _with_ends(panel: Panel) -> Panel:
    """Return the panel with the ends of the interval as lines, uneven about the trend."""
    marks: list[AnyMark] = []
    for mark in panel.marks:
        if isinstance(mark, Band):
            ends = ((mark.low, mark.name), (mark.high, ""))
            marks += [Curve(x=mark.x, y=y, role="faint", name=name, emphasis="thin") for y, name in ends]
        elif not isinstance(mark, Bars):
            marks.append(mark)
    return replace(panel, marks=tuple(marks))
