"""Raw: every numeric field of every topic by family, every text and flag as a lane; long topics thinned, saying so."""

import re
from dataclasses import dataclass

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.signals import RAW_PREFIX, TOPICS, field_of, kind_of
from groundstation.results.flight import FlightResults
from groundstation.tables.table import Flight, Table
from groundstation.viewer import colours
from groundstation.viewer.markdown import markdown_text, table
from groundstation.viewer.names import label, path_parts, split_unit, topic_label, words
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, covers_gap, gap_after, rows_that_fit, runs, thin, wraps_after
from groundstation.viewer.views import document, figure_of, lanes, numbers, plot

SCALARS = 1_200_000  # numbers in this tab: about 25 MB, an hour at 100 Hz
COLUMNS_OF_VIEWS = 2
CIRCULAR = ("heading", "track")
STATES = "states"  # part of the path of every lane: no family may have it
MAX_VIEWS = 24  # of one topic; the fields of the families beyond share the last one
MAX_TOPICS = 300  # with a page: the SDK never returns from sending a layout of some 5000 views
MAX_ALL_VIEWS = 2_000  # where many topics have many families, each topic has fewer views
MAX_LANE_ROWS = 5_000  # a lane with more changes is no lane
_AXES = re.compile(r"(_(north|east|down|x|y|z|w|forward|right|roll|pitch|xx|xy|xz|yy|yz|zz)|\[?\d+\]?)$")


@dataclass(frozen=True)
class Family:
    """Fields of one topic that belong on one axis and share their rows.

    ``breaks`` tells after which rows the lines end, shape (n - 1,). ``name`` is the field's own, without unit, where
    the family has one field alone.
    """

    topic: str
    name: str
    fields: tuple[str, ...]
    time_ns: Int64Array
    values: FloatArray
    breaks: BoolArray
    is_circular: bool

    @property
    def title(self) -> str:
        """Title of the view, with the unit."""
        topic = _title(self.topic)
        if len(self.fields) == 1:
            return f"{topic} {label(self.fields[0])}"
        unit = split_unit(self.fields[0])[1]
        return f"{topic} {words(self.name)}, {unit}" if unit else f"{topic} {words(self.name)}"


def raw(recorder: Recorder, flight: Flight, results: FlightResults) -> rrb.Container | None:
    """Log every topic; None for a flight without samples."""
    gaps = figure_of(results, "gaps", "topic", "start_s")
    filled = sorted((topic for topic in flight.topics() if len(flight[topic])), key=_reading_order)
    topics, without_page = filled[:MAX_TOPICS], filled[MAX_TOPICS:]
    most_views = min(MAX_VIEWS, max(MAX_ALL_VIEWS // max(len(topics), 1), 1))
    families: dict[str, list[Family]] = {}
    for topic in topics:
        starts = np.zeros(0) if gaps is None else numbers(gaps, "start_s")[gaps["topic"] == topic]
        families[topic] = _families(flight[topic], recorder.time_ns(starts))
    everyone = [family for own in families.values() for family in own]
    limit = rows_that_fit([len(one.time_ns) for one in everyone], [len(one.fields) for one in everyone], SCALARS)
    kept: dict[str, int] = {}
    left_out: list[str] = []
    canonical: list[rrb.Container] = []
    other: list[rrb.Container] = []
    for topic, part in zip(topics, path_parts(topics), strict=True):
        base = f"raw/{part}"
        kept[topic], views = _log_families(recorder, base, families[topic], limit, most_views)
        pictures, too_busy = _lanes(recorder, base, flight[topic])
        views += pictures
        left_out += [f"{topic}.{field}" for field in too_busy]
        if views:
            page = rrb.Grid(contents=views, grid_columns=min(COLUMNS_OF_VIEWS, len(views)), name=_title(topic))
            (other if topic.startswith(RAW_PREFIX) else canonical).append(page)
    pages = [*canonical, *([rrb.Tabs(contents=other, name="other topics")] if other else [])]
    if not pages and not left_out:
        return None
    recorder.document("raw/about", _about(flight, families, kept, left_out, without_page))
    pages.append(rrb.Vertical(contents=[document("What is shown here", "raw/about")], name="about"))
    return rrb.Tabs(contents=pages, name="Raw", active_tab=0)


def _reading_order(topic: str) -> tuple[int, int, str]:
    kinds = list(TOPICS)
    kind = kind_of(topic)
    return kinds.index(kind) if kind in kinds else len(kinds), len(topic), topic


def _title(topic: str) -> str:
    return topic_label(topic.removeprefix(RAW_PREFIX))


def family_of(topic: str, field: str) -> str:
    """Family of a field: fields of one family share a view.

    Examples
    --------
    >>> family_of("ins", "velocity_north_mps"), family_of("ins", "altitude_msl_m"), family_of("gnss", "track_deg")
    ('velocity', 'altitude', 'track')
    >>> family_of("ins", "roll_deg"), family_of("raw.csv", "volt1"), family_of("gnss", "hdop")
    ('roll and pitch', 'volt', 'dilution of precision')
    """
    known = field_of(topic, field)
    if known is not None and known.is_heading:
        return "track" if field.startswith("track") else "heading"
    name = split_unit(field)[0]
    if name in ("roll", "pitch"):
        return "roll and pitch"
    if name in ("gdop", "pdop", "hdop"):
        return "dilution of precision"
    if name.startswith("altitude_"):
        return "altitude"
    return _AXES.sub("", name) or name


def _families(table_of_topic: Table, gap_starts_ns: Int64Array) -> list[Family]:
    """Numeric fields by family and by the rows where they are present: absent is not a gap, NaN from the device is."""
    groups: dict[tuple[str, str, bytes], list[str]] = {}
    for field, column in table_of_topic.columns.items():
        if column.values.dtype.kind not in "fiu" or not len(column) or not column.mask.any():
            continue
        presence = b"" if column.present is None else np.packbits(column.present).tobytes()
        key = (family_of(table_of_topic.topic, field), split_unit(field)[1], presence)
        groups.setdefault(key, []).append(field)
    found = []
    breaks_of: dict[bytes, BoolArray] = {}
    for (name, _unit, presence), fields in groups.items():
        mask = table_of_topic.columns[fields[0]].mask
        time_ns = table_of_topic.time_ns[mask]
        values = np.column_stack([np.asarray(table_of_topic.columns[field].values, float)[mask] for field in fields])
        if presence not in breaks_of:
            breaks_of[presence] = gap_after(time_ns) | covers_gap(time_ns, gap_starts_ns)
        title = name if len(fields) > 1 else split_unit(fields[0])[0]
        breaks = breaks_of[presence]
        found.append(Family(table_of_topic.topic, title, tuple(fields), time_ns, values, breaks, name in CIRCULAR))
    return found


def _log_families(
    recorder: Recorder, base: str, families: list[Family], limit: int, most_views: int
) -> tuple[int, list[rrb.View]]:
    """Log the families of one topic; most rows kept of any, and their views."""
    paths = [f"{base}/{part}" for part in path_parts([STATES, *(family.name for family in families)])[1:]]
    most = 0
    for family, path in zip(families, paths, strict=True):
        lines = [
            Line(label(field), colour)
            for field, colour in zip(family.fields, colours.for_series(len(family.fields)), strict=True)
        ]
        rows = thin(family.values, family.breaks, limit)
        time_ns, values = family.time_ns[rows], family.values[rows]
        breaks = family.breaks[rows[:-1]]
        if family.is_circular:
            breaks = breaks | wraps_after(values)
        recorder.lines(path, time_ns, values, lines, breaks)
        most = max(most, len(rows))
    views: list[rrb.View] = [
        plot(family.title, path, legend=len(family.fields) > 1) for family, path in zip(families, paths, strict=True)
    ]
    if len(views) > most_views:
        views[most_views - 1 :] = [plot(f"{len(views) - most_views + 1} more", paths[most_views - 1 :])]
    return most, views


def _lanes(recorder: Recorder, base: str, table_of_topic: Table) -> tuple[list[rrb.View], list[str]]:
    """Log texts and flags as lanes of their changes; the view, and the fields that change too often to be one."""
    fields = [name for name, column in table_of_topic.columns.items() if column.values.dtype.kind in "Ub"]
    paths, too_busy = [], []
    for field, part in zip(fields, path_parts(fields), strict=True):
        states = _states(table_of_topic.columns[field])
        changes = runs(states)
        if len(changes) > MAX_LANE_ROWS:
            too_busy.append(field)
        elif (states != "").any():
            path = f"{base}/{STATES}/{part}"
            recorder.lane(path, table_of_topic.time_ns[changes], states[changes].tolist(), colours.FLAGS)
            paths.append(path)
    return [lanes(f"{_title(table_of_topic.topic)} states", paths)] if paths else [], too_busy


def _states(column: Column) -> np.ndarray:
    values = np.where(column.values, "yes", "no") if column.values.dtype.kind == "b" else column.values
    return np.where(column.mask, values, "")


def _about(
    flight: Flight,
    families: dict[str, list[Family]],
    kept: dict[str, int],
    left_out: list[str],
    without_page: list[str],
) -> str:
    rows = []
    for topic, own in families.items():
        total = max((len(family.time_ns) for family in own), default=len(flight[topic]))
        shown = "every row" if kept[topic] >= total or not own else f"{kept[topic]} of {total} rows"
        rows.append([markdown_text(topic), str(len(flight[topic])), str(sum(len(one.fields) for one in own)), shown])
    parts = [
        "# What is shown here",
        "Long topics are thinned for the screen: of every stretch the rows with the lowest and the highest value "
        "of each series are kept, and both sides of each gap. No value is altered. The MCAP beside this recording "
        "holds every row.",
        table(["topic", "rows", "numeric fields", "shown"], rows),
    ]
    if left_out:
        names = ", ".join(markdown_text(name) for name in left_out)
        parts.append(f"Texts that change more than {MAX_LANE_ROWS} times are no lanes and are not shown: {names}.")
    if without_page:
        names = ", ".join(markdown_text(topic) for topic in without_page)
        parts.append(f"{len(without_page)} topics beyond the first {MAX_TOPICS} have no page: {names}.")
    return "\n\n".join(parts)
