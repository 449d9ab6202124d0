"""Landing by locators: deviations from course and glide path with their bands, and what was found."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.landing_beacons import landing_beacons as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.results.landing_beacons import BeaconLanding
from groundstation.results.landing_categories import LINEAR_95
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import gap_after
from groundstation.viewer.views import document, figure_of, numbers, plot

DEVIATIONS = (("lateral", "Right of course, m", 150.0), ("glide_path", "Above glide path, m", 40.0))
BOLD, THIN = 1.5, 1.0


def landing_beacons(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    answer, section = results.answer(BeaconLanding), chapter(results)
    data = figure_of(results, "landing_beacons_path", "time_s", "lateral_m", "glide_path_m", "before_threshold_m")
    if answer is None or section is None or data is None:
        return None
    recorder.document("landing_beacons/answer", markdown(section))
    time_ns = recorder.time_ns(numbers(data, "time_s"))
    views: list[rrb.View] = []
    for column, title, most in DEVIATIONS:
        half = LINEAR_95 * numbers(data, f"{column}_sigma_m")
        path, gaps = f"landing_beacons/{column}", gap_after(time_ns)
        place = np.clip(numbers(data, f"{column}_m"), -most, most)
        name = Line("95 % of one place, m", colours.HONEST, THIN)
        recorder.band(f"{path}/a_band", time_ns, np.zeros(len(half)), np.clip(half, 0.0, most), name, gaps)
        line = Line("deviation, m", colours.ANSWER, BOLD)
        recorder.lines(f"{path}/b_deviation", time_ns, place[:, None], [line], gaps)
        views.append(plot(f"{title} (cut at {most:g} m)", path, axis_range=(-most, most)))
    path = "landing_beacons/distance"
    far = numbers(data, "before_threshold_m")[:, None]
    recorder.lines(path, time_ns, far, [Line("before the threshold, m", colours.LIGHT, BOLD)], gap_after(time_ns))
    views.append(plot("Before the threshold, m", path, axis_range=(-1000.0, 6000.0)))
    text = document("What was found", "landing_beacons/answer")
    contents: list[rrb.View | rrb.Container] = [rrb.Vertical(contents=views), text]
    return rrb.Horizontal(contents=contents, column_shares=[3.0, 2.0], name="Landing by locators")
