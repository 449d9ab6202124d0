"""Recording of two saved flights: the plots of their page, B on the clock of A."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.timescales import iso_to_utc_ns
from groundstation.chapters.comparison import answers, findings, opening, settings
from groundstation.chapters.markdown import markdown, part_markdown
from groundstation.chapters.parts import shortened
from groundstation.chapters.plots.comparison import COMPARED, PlottedSide, Tell, sides_of
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight
from groundstation.systems.system import Systems
from groundstation.viewer.held_stream import HeldStream
from groundstation.viewer.names import clean_text
from groundstation.viewer.plot_views import panels_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.recording import NamedTab, save_stream, send_tabs
from groundstation.viewer.views import document

Rows = tuple[tuple[str, ...], ...]  # names of plots, side by side in rows
OVER_TIME: Rows = (
    ("overview-altitude_m",),
    ("overview-pressure_altitude_m",),
    ("overview-ground_speed_mps",),
    ("overview-heading_deg",),
    ("phases",),
)
MOST_ROWS = 100  # of a table: the viewer lays out the whole text again and again


def write_comparison(path: Path, comparison: Comparison, a: SavedFlight, b: SavedFlight, systems: Systems) -> None:
    """Write the recording that holds both flights.

    ``systems`` are those whose figures it shows.

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    identity = f"compare {comparison.a.flight_id} {comparison.b.flight_id}"
    save_stream(path, identity, lambda stream: send_comparison(stream, comparison, a, b, systems))


def send_comparison(
    stream: rr.RecordingStream, comparison: Comparison, a: SavedFlight, b: SavedFlight, systems: Systems
) -> rrb.Blueprint:
    """Log both flights to a stream that has its sink, send the layout; returns it.

    There is a timeline ``utc`` only where the clocks are aligned by UTC: otherwise one of them is moved.
    """
    has_utc = comparison.alignment.event == "utc" and comparison.a.start_utc is not None
    start_ns = iso_to_utc_ns(str(comparison.a.start_utc))[0] if has_utc else 0
    held = HeldStream(stream)
    recorder = Recorder(held.stream, start_ns, has_utc, systems)
    stream.send_recording_name(clean_text(f"{comparison.a.flight_id} | {comparison.b.flight_id}"))
    sides = sides_of(comparison, a, b)
    return send_tabs(stream, held, _tabs(recorder, comparison, sides))


def _tabs(recorder: Recorder, comparison: Comparison, sides: Sequence[PlottedSide]) -> Iterator[NamedTab]:
    """Tabs in their order: the name of each and what logs it."""
    yield "overview", partial(_overview, recorder, comparison, sides)
    for one in recorder.systems.compared:
        yield one.name, partial(_grid, one.rows, one.title, recorder, sides, one.figures)


def _overview(recorder: Recorder, comparison: Comparison, sides: Sequence[PlottedSide]) -> rrb.Container:
    recorder.document("comparison", comparison_text(comparison))
    text = document("A and B", "comparison")
    ground = panels_of(recorder, COMPARED["tracks"](sides), of="Tracks")
    left = rrb.Vertical(contents=[*ground, text]) if ground else text
    right = _grid(OVER_TIME, "", recorder, sides, COMPARED)
    return rrb.Horizontal(contents=[left, *([] if right is None else [right])], name="Overview of A and B")


def _grid(
    rows: Rows, name: str, recorder: Recorder, sides: Sequence[PlottedSide], figures: Mapping[str, Tell]
) -> rrb.Container | None:
    """Log plots, and show each row of them side by side; None where there is none."""
    drawn = [[view for plot in row for view in panels_of(recorder, figures[plot](sides))] for row in rows]
    lines = [rrb.Horizontal(contents=views) if len(views) > 1 else views[0] for views in drawn if views]
    return rrb.Vertical(contents=lines, name=name) if lines else None


def comparison_text(comparison: Comparison) -> str:
    """Return Markdown of the panel."""
    sections = (answers(comparison), settings(comparison), findings(comparison))
    told = (markdown(shortened(one, MOST_ROWS, "compare.html"), level=2) for one in sections if one is not None)
    return "\n\n".join([*map(part_markdown, opening(comparison)), *told])
