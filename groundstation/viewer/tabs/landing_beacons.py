"""Landing by locators: deviations from course and glide path with their bands, over each approach's own time."""

from collections.abc import Callable

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.landing_beacons import landing_beacons as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.arrays.landing import BeaconsPath
from groundstation.results.flight import FlightResults
from groundstation.results.landing_beacons import BeaconApproachRow, BeaconLanding
from groundstation.results.landing_categories import LINEAR_95
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.run_chart import Run, RunChart
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import document

Column = Callable[[BeaconsPath], FloatArray]
DEVIATIONS: tuple[tuple[str, str, float, Column, Column], ...] = (  # name, title, most, values, their sigma
    ("lateral", "Right of course, m", 150.0, lambda path: path.lateral_m, lambda path: path.lateral_sigma_m),
    ("glide_path", "Above glide path, m", 40.0, lambda path: path.glide_path_m, lambda path: path.glide_path_sigma_m),
)
FARTHEST_M, NEAREST_M = 6000.0, -1000.0
SMALL, THIN, BOLD = 1.2, 1.0, 1.5
MOST_APPROACHES = 6


def landing_beacons(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    answer, section = results.answer(BeaconLanding), chapter(results)
    data = results.rows_of(BeaconsPath)
    if answer is None or section is None or data is None:
        return None
    recorder.document("landing_beacons/answer", markdown(section))
    tabs = [_approach(recorder, one, data) for one in answer.approaches[:MOST_APPROACHES]]
    approaches = tabs[0] if len(tabs) == 1 else rrb.Tabs(contents=tabs, active_tab=0)
    text = document("What was found", "landing_beacons/answer")
    return rrb.Horizontal(contents=[approaches, text], column_shares=[3.0, 2.0], name="Landing by locators")


def _approach(recorder: Recorder, one: BeaconApproachRow, data: BeaconsPath) -> rrb.Container:
    """Deviations of one approach and its distance, from 6 km on to its end; what lies beyond the axes is cut."""
    is_mine = data.approach == one.approach
    near = is_mine & (data.straight_before_threshold_m < FARTHEST_M)
    flown = data.where(near if near.sum() > 1 else is_mine)
    time_s, path = flown.time_s, f"landing_beacons/{one.approach}"
    run = Run(float(time_s[0]), float(time_s[-1]))
    band, dots = Line("95 % of one position", colours.HONEST, BOLD), Line("deviation", colours.ANSWER, SMALL)
    views: list[rrb.View] = []
    for name, title, most, values_of, sigma_of in DEVIATIONS:
        half = np.clip(LINEAR_95 * sigma_of(flown), 0.0, most)
        chart = RunChart(recorder, f"{path}/{name}", f"{title},", run, [], (-most, most))
        chart.band("a_band", time_s, -half, half, band)
        chart.dots("b_deviation", time_s, np.clip(values_of(flown), -most, most), dots)
        views.append(chart.view([band, dots]))
    line = Line("before the threshold", colours.LIGHT, THIN)
    chart = RunChart(recorder, f"{path}/distance", "Before the threshold, m,", run, [], (NEAREST_M, FARTHEST_M))
    far = flown.before_threshold_m
    chart.line("line", time_s, np.where((far > NEAREST_M) & (far < FARTHEST_M), far, np.nan), line)
    views.append(chart.view())
    return rrb.Vertical(contents=views, name=f"Approach {one.approach}")
