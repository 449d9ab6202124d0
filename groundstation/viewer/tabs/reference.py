"""Against the reference: errors of every subject over time in the band that is claimed, and what was found."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.markdown import markdown
from groundstation.chapters.reference import reference as chapter
from groundstation.results.figures import FigureData, texts
from groundstation.results.figures import numbers as column_of
from groundstation.results.flight import FlightResults
from groundstation.results.reference import title_of
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import gap_after
from groundstation.viewer.views import document, figure_of, plot

# Of each page: column, title, sigma claimed, over how many components that is.
PAGES = {
    "Position": (
        *(("north_m", "north, m", "horizontal_sigma_m", 2), ("east_m", "east, m", "horizontal_sigma_m", 2)),
        ("up_m", "up, m", "vertical_sigma_m", 1),
    ),
    "Velocity": (
        ("north_mps", "north, m/s", "velocity_sigma_mps", 2),
        ("east_mps", "east, m/s", "velocity_sigma_mps", 2),
    ),
    "Attitude": (
        ("roll_deg", "roll, deg", "roll_sigma_deg", 1),
        ("pitch_deg", "pitch, deg", "pitch_sigma_deg", 1),
        ("heading_deg", "heading, deg", "true_heading_sigma_deg", 1),
    ),
}
SHADES = {"gnss": colours.GNSS, "ins": colours.INS, "corrected": colours.ANSWER, "smoothed": colours.PINK}
BOLD, THIN = 1.5, 1.0


def reference(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    data, section = figure_of(results, "reference_errors", "subject", "time_s"), chapter(results)
    if data is None or section is None or "reference" not in results.answers:
        return None
    recorder.document("reference/answer", markdown(section))
    pages = []
    for page, listed in PAGES.items():
        columns = [
            rrb.Vertical(contents=views, name=title_of(subject))
            for subject in dict.fromkeys(texts(data, "subject").tolist())
            if (views := _views(recorder, data, subject, listed))
        ]
        if columns:
            pages.append(rrb.Horizontal(contents=columns, name=page))
    text = document("What was found", "reference/answer")
    return rrb.Horizontal(contents=[rrb.Tabs(contents=pages), text], column_shares=[3.0, 2.0], name="Reference")


def _views(
    recorder: Recorder, data: FigureData, subject: str, listed: tuple[tuple[str, str, str, int], ...]
) -> list[rrb.View]:
    """Plots of a subject, those of which it has values."""
    mine = texts(data, "subject") == subject
    time_ns = recorder.time_ns(column_of(data, "time_s")[mine])
    gaps, shade = gap_after(time_ns), SHADES.get(subject.partition(".")[0], colours.ANSWER)
    views: list[rrb.View] = []
    for column, title, sigma, components in listed:
        values = column_of(data, column)[mine]
        if not np.isfinite(values).any():
            continue
        path = f"reference/{subject.replace('.', '_')}/{column}"
        half = NORMAL_95 * column_of(data, sigma)[mine] / np.sqrt(components)
        if np.isfinite(half).any():
            band = Line("95 % claimed", colours.HONEST, THIN)
            recorder.band(f"{path}/a_band", time_ns, np.zeros(len(half)), half, band, gaps)
        recorder.lines(f"{path}/b_error", time_ns, values[:, None], [Line("error", shade, BOLD)], gaps)
        views.append(plot(f"{title_of(subject)} − reference, {title}", path))
    return views
