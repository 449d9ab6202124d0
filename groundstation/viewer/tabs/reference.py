"""Against the reference: errors of every subject over time in the band that is claimed, and what was found."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.markdown import markdown
from groundstation.chapters.reference import reference as chapter
from groundstation.results.arrays.reference import ReferenceErrors
from groundstation.results.flight import FlightResults
from groundstation.results.reference import title_of
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.views import document, plot

Column = Callable[[ReferenceErrors], FloatArray]


@dataclass(frozen=True)
class ReferenceLine:
    """An error of a page: end of its path, title, values, and the sigma claimed of so many axes."""

    part: str
    title: str
    error_of: Column
    sigma_of: Column
    components: int


PAGES = {
    "Position": (
        ReferenceLine("north_m", "north, m", lambda data: data.north_error_m, lambda data: data.horizontal_sigma_m, 2),
        ReferenceLine("east_m", "east, m", lambda data: data.east_error_m, lambda data: data.horizontal_sigma_m, 2),
        ReferenceLine("up_m", "up, m", lambda data: data.up_error_m, lambda data: data.vertical_sigma_m, 1),
    ),
    "Velocity": (
        ReferenceLine(
            "north_mps", "north, m/s", lambda data: data.north_error_mps, lambda data: data.velocity_sigma_mps, 2
        ),
        ReferenceLine(
            "east_mps", "east, m/s", lambda data: data.east_error_mps, lambda data: data.velocity_sigma_mps, 2
        ),
    ),
    "Attitude": (
        ReferenceLine("roll_deg", "roll, deg", lambda data: data.roll_error_deg, lambda data: data.roll_sigma_deg, 1),
        ReferenceLine(
            "pitch_deg", "pitch, deg", lambda data: data.pitch_error_deg, lambda data: data.pitch_sigma_deg, 1
        ),
        ReferenceLine(
            "heading_deg",
            "heading, deg",
            lambda data: data.heading_error_deg,
            lambda data: data.true_heading_sigma_deg,
            1,
        ),
    ),
}
SHADES = {"gnss": colours.GNSS, "ins": colours.INS, "corrected": colours.ANSWER, "smoothed": colours.YELLOW}
BOLD, THIN = 1.5, 1.0


def reference(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    data, section = results.rows_of(ReferenceErrors), chapter(results)
    if data is None or section is None or "reference" not in results.answers:
        return None
    recorder.document("reference/answer", markdown(section))
    pages = []
    for page, listed in PAGES.items():
        columns = [
            rrb.Vertical(contents=views, name=title_of(subject))
            for subject in dict.fromkeys(data.subject.tolist())
            if (views := _views(recorder, data, subject, listed))
        ]
        if columns:
            pages.append(rrb.Horizontal(contents=columns, name=page))
    text = document("What was found", "reference/answer")
    return rrb.Horizontal(contents=[rrb.Tabs(contents=pages), text], column_shares=[3.0, 2.0], name="Reference")


def _views(
    recorder: Recorder, data: ReferenceErrors, subject: str, listed: tuple[ReferenceLine, ...]
) -> list[rrb.View]:
    """Plots of a subject, those of which it has values."""
    mine = data.where(data.subject == subject)
    time_ns = recorder.time_ns(mine.time_s)
    gaps, shade = gap_after(time_ns), SHADES.get(subject.partition(".")[0], colours.ANSWER)
    views: list[rrb.View] = []
    for shown in listed:
        values = shown.error_of(mine)
        if not np.isfinite(values).any():
            continue
        path = f"reference/{subject.replace('.', '_')}/{shown.part}"
        half = NORMAL_95 * shown.sigma_of(mine) / np.sqrt(shown.components)
        has_band = bool(np.isfinite(half).any())
        if has_band:
            band = Line("95 % claimed", colours.HONEST, THIN)
            recorder.band(f"{path}/a_band", time_ns, np.zeros(len(half)), half, band, gaps)
        recorder.lines(f"{path}/b_error", time_ns, values[:, None], [Line("error", shade, BOLD)], gaps)
        views.append(plot(f"{title_of(subject)}: {shown.title}", path, legend=has_band))
    return views
