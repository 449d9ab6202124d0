"""Tab of raw data: every numeric field of every topic by family, texts and flags as lanes.

Long topics are thinned, and their titles say so. Topics that are no series (parameters, definitions, single records:
most rows at one instant) are tables.
"""

import re
from collections.abc import Iterator, Mapping

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.signals import RAW_PREFIX, TOPICS, field_of, kind_of
from groundstation.base.source_units import source_units
from groundstation.base.words import counted
from groundstation.chapters.markdown import table
from groundstation.results.arrays.flight import GapRows
from groundstation.results.flight import FlightResults
from groundstation.tables.table import Flight, Table
from groundstation.viewer import colours
from groundstation.viewer.names import (
    clean_text,
    label,
    markdown_text,
    natural_order,
    path_parts,
    source_label,
    split_unit,
    topic_label,
    words,
)
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, covers_gap, gap_after, rows_that_fit, runs, thin_series, wraps_after
from groundstation.viewer.views import document, lanes, plot

SCALARS = 1_200_000  # numbers in this tab: about 25 MB, an hour at 100 Hz
VIEWS_OF_A_COLUMN, FEWEST_COLUMNS, MOST_COLUMNS = 6, 2, 4  # more views in a column are too low to be read
CIRCULAR = ("heading", "track")
COUNTS = ("satellites_used", "cycles", "rank", "slot")
STATES = "states"  # part of the path of every lane: no family may have it
MAX_VIEWS = 24  # of one topic; the fields of the families beyond share the last one
MAX_TOPICS = 300  # with a page: the SDK never returns from sending a layout of some 5000 views
MAX_ALL_VIEWS = 2_000  # where many topics have many families, each topic has fewer views
MAX_LANE_ROWS = 5_000  # a lane with more changes is no lane
MAX_LIST_ROWS, MAX_LIST_COLUMNS, MAX_CELL = 2_000, 40, 120  # of a table; a note says what is cut off
TICKS_NS = (1, 1_000, 1_000_000, 1_000_000_000)  # units in which devices count their time
CLOCK_NS = 200_000_000  # a field that follows the time of its rows this closely only repeats it
ALONE = 0.1  # share of rows without a neighbour above which a raw topic has no rate, and no gaps either
_AXES = re.compile(r"(_(north|east|down|x|y|z|w|forward|right|roll|pitch|xx|xy|xz|yy|yz|zz)|\[?\d+\]?)$")


@dataclass(frozen=True)
class FieldFamily:
    """Fields of one topic that belong on one axis and share their rows.

    ``rows`` are those that have them, shape (n,), None for all. ``breaks`` tells after which of them the lines end,
    shape (n - 1,). ``name`` is the field's own, without unit, where
    the family has one field alone. ``unit`` is the source's for topics that are not ours.
    """

    topic: str
    name: str
    fields: tuple[str, ...]
    table: Table
    rows: BoolArray | None
    breaks: BoolArray
    is_circular: bool
    is_stepped: bool = False
    unit: str = ""

    def __len__(self) -> int:
        return len(self.breaks) + 1

    @property
    def time_ns(self) -> Int64Array:
        """Times of its rows."""
        return self.table.time_ns if self.rows is None else self.table.time_ns[self.rows]

    def series(self) -> Iterator[FloatArray]:
        """Yield the values of each field at its rows, float64, shape (n,)."""
        for field in self.fields:
            values = np.asarray(self.table.columns[field].values, float)
            yield values if self.rows is None else values[self.rows]

    @property
    def title(self) -> str:
        """Title of the view, with the unit."""
        topic = _title(self.topic)
        if self.topic.startswith(RAW_PREFIX):  # units only as the source spells them
            name = source_label(self.fields[0] if len(self.fields) == 1 else self.name)
            return ", ".join(filter(None, (f"{topic} {name}", clean_text(self.unit))))
        if len(self.fields) == 1:
            return f"{topic} {label(self.fields[0])}"
        unit = split_unit(self.fields[0])[1]
        return f"{topic} {words(self.name)}, {unit}" if unit else f"{topic} {words(self.name)}"


def raw(recorder: Recorder, flight: Flight, results: FlightResults) -> rrb.Container | None:
    """Log every topic; None for a flight without samples."""
    gaps = results.rows_of(GapRows)
    filled = sorted((topic for topic in flight.topics() if len(flight[topic])), key=_reading_order)
    topics, without_page = filled[:MAX_TOPICS], filled[MAX_TOPICS:]
    most_views = min(MAX_VIEWS, max(MAX_ALL_VIEWS // max(len(topics), 1), 1))
    families: dict[str, list[FieldFamily]] = {}
    listed = {topic for topic in topics if is_list(flight[topic])}
    for topic in topics:
        if topic in listed:
            families[topic] = []
            continue
        starts = np.zeros(0) if gaps is None else gaps.start_s[gaps.topic == topic]
        units = source_units(flight.metadata, topic, flight[topic].columns)
        families[topic] = _families(flight[topic], recorder.time_ns(starts), units)
    everyone = [family for own in families.values() for family in own]
    limit = rows_that_fit([len(one) for one in everyone], [len(one.fields) for one in everyone], SCALARS)
    kept: dict[str, int] = {}
    left_out: list[str] = []
    canonical: list[rrb.Container] = []
    other: list[rrb.Container] = []
    for topic, part in zip(topics, path_parts(topics), strict=True):
        base = f"raw/{part}"
        page: rrb.Container
        if topic in listed:
            recorder.document(f"{base}/{STATES}", _list(flight[topic]))
            kept[topic] = len(flight[topic])
            page = rrb.Vertical(contents=[document(_title(topic), f"{base}/{STATES}")], name=_title(topic))
            (other if topic.startswith(RAW_PREFIX) else canonical).append(page)
            continue
        kept[topic], views = _log_families(recorder, base, families[topic], limit, most_views)
        pictures, too_busy = _lanes(recorder, base, flight[topic])
        views += pictures
        left_out += [f"{topic}.{field}" for field in too_busy]
        if views:
            page = rrb.Grid(contents=views, grid_columns=columns_of(len(views)), name=_title(topic))
            (other if topic.startswith(RAW_PREFIX) else canonical).append(page)
    pages = [*canonical, *([rrb.Tabs(contents=other, name="other topics")] if other else [])]
    if not pages and not left_out:
        return None
    recorder.document("raw/about", _about(flight, families, kept, left_out, without_page))
    pages.append(rrb.Vertical(contents=[document("What is shown here", "raw/about")], name="about"))
    return rrb.Tabs(contents=pages, name="Raw", active_tab=0)


def _reading_order(topic: str) -> tuple[int, tuple[tuple[str, int], ...]]:
    kinds = list(TOPICS)
    kind = kind_of(topic)
    return kinds.index(kind) if kind in kinds else len(kinds), natural_order(topic)


def _title(topic: str) -> str:
    return source_label(topic.removeprefix(RAW_PREFIX)) if topic.startswith(RAW_PREFIX) else topic_label(topic)


def is_list(table_of_topic: Table) -> bool:
    """Tell whether a raw topic is a list rather than a series.

    Half of its rows or more are at one instant.
    """
    if not table_of_topic.topic.startswith(RAW_PREFIX):
        return False
    times, counts = np.unique(table_of_topic.time_ns, return_counts=True)
    return len(times) == 1 or bool(2 * counts.max() >= len(table_of_topic) and counts.max() > 2)


def _list(table_of_topic: Table) -> str:
    """Return the rows of a list as a table; a single row is transposed."""
    rows = table_of_topic.take(slice(0, MAX_LIST_ROWS))
    names = [name for name, column in rows.columns.items() if column.mask.any()]
    shown = names[:MAX_LIST_COLUMNS] if len(rows) > 1 else names
    cells = [_cells(rows.columns[name]) for name in shown]
    heads = [markdown_text(source_label(name)) for name in shown]
    if len(rows) == 1:
        text = table(["field", "value"], [[head, column[0]] for head, column in zip(heads, cells, strict=True)])
    else:
        text = table(heads, [list(row) for row in zip(*cells, strict=True)])
    told = [f"{counted(len(table_of_topic), 'row')}, most with the same time: a list, not a series."]
    if len(rows) < len(table_of_topic) or len(shown) < len(names):
        told.append(f"Shown: {counted(len(rows), 'row')}, {len(shown)} of {counted(len(names), 'field')}.")
    return "\n\n".join([" ".join(told) if len(table_of_topic) > 1 else "One record.", text])


def _cells(column: Column) -> list[str]:
    values = np.where(column.values, "yes", "no") if column.values.dtype.kind == "b" else column.values
    texts = [f"{value:.7g}" if isinstance(value, float) else str(value) for value in values.tolist()]
    return [
        markdown_text(clean_text(text, MAX_CELL)) if known else ""
        for text, known in zip(texts, column.mask.tolist(), strict=True)
    ]


def repeats_the_time(table_of_topic: Table, field: str) -> bool:
    """Tell whether a field of a raw topic is the clock of its own rows.

    Drawn, it would be a ramp on every page.
    """
    column = table_of_topic.columns[field]
    if not table_of_topic.topic.startswith(RAW_PREFIX) or len(column) < 3 or column.values.dtype.kind not in "iu":
        return False
    device = table_of_topic.device_time_ns
    known = column.mask & device.mask
    if not known.any() or device.values[known].min() < 10 * CLOCK_NS:  # so early any small number would pass
        return False
    values, time_ns = column.values[known].astype(np.float64), device.values[known].astype(np.float64)
    return any(bool((np.abs(values * tick - time_ns) <= CLOCK_NS).all()) for tick in TICKS_NS)


def family_of(topic: str, field: str) -> str:
    """Return the family of a field: fields of one family share a view.

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


def _families(table_of_topic: Table, gap_starts_ns: Int64Array, units: Mapping[str, str]) -> list[FieldFamily]:
    """Return numeric fields by family and by the rows where they are present.

    An absent value is not a gap, NaN from the device is. ``units`` are those that the source tells. Counts and codes,
    which hold until the next one, are stepped.
    """
    groups: dict[tuple[str, str, bool, bytes], list[str]] = {}
    for field, column in table_of_topic.columns.items():
        if column.values.dtype.kind not in "fiu" or not len(column) or not column.mask.any():
            continue
        if repeats_the_time(table_of_topic, field):
            continue
        presence = b"" if column.present is None else np.packbits(column.present).tobytes()
        is_stepped = column.values.dtype.kind in "iu" or field in COUNTS
        unit = units.get(field) or split_unit(field)[1]
        key = (family_of(table_of_topic.topic, field), unit, is_stepped, presence)
        groups.setdefault(key, []).append(field)
    found = []
    breaks_of: dict[bytes, BoolArray] = {}
    for (name, _unit, is_stepped, presence), fields in groups.items():
        rows = table_of_topic.columns[fields[0]].present
        if presence not in breaks_of:
            time_ns = table_of_topic.time_ns if rows is None else table_of_topic.time_ns[rows]
            breaks = gap_after(time_ns) | covers_gap(time_ns, gap_starts_ns)
            breaks_of[presence] = (
                breaks & (not _isolates(breaks)) if table_of_topic.topic.startswith(RAW_PREFIX) else breaks
            )
        title = name if len(fields) > 1 else split_unit(fields[0])[0]
        breaks = breaks_of[presence]
        unit = units.get(fields[0], "")
        of_topic = table_of_topic.topic, title, tuple(fields), table_of_topic, rows
        found.append(FieldFamily(*of_topic, breaks, name in CIRCULAR, is_stepped, unit))
    return found


def _isolates(breaks: BoolArray) -> bool:
    """Tell whether breaks leave many rows alone.

    A line of one point is not drawn, and a topic with so rare rows has no gaps.
    """
    edges = np.concatenate([[True], breaks, [True]])
    return bool(np.count_nonzero(edges[1:] & edges[:-1]) > ALONE * (len(breaks) + 1))


def columns_of(views: int) -> int:
    """Return the number of columns of a page with so many views.

    Examples
    --------
    >>> [columns_of(views) for views in (1, 2, 12, 13, 24)]
    [1, 2, 2, 3, 4]
    """
    return min(views, max(FEWEST_COLUMNS, min(-(-views // VIEWS_OF_A_COLUMN), MOST_COLUMNS)))


def _log_families(
    recorder: Recorder, base: str, families: list[FieldFamily], limit: int, most_views: int
) -> tuple[int, list[rrb.View]]:
    """Log the families of one topic; most rows kept of any, and their views."""
    paths = [f"{base}/{part}" for part in path_parts([STATES, *(family.name for family in families)])[1:]]
    most = 0
    for family, path in zip(families, paths, strict=True):
        name_of = source_label if family.topic.startswith(RAW_PREFIX) else label
        lines = [
            Line(name_of(field), colour)
            for field, colour in zip(family.fields, colours.for_series(len(family.fields)), strict=True)
        ]
        series = list(family.series())
        rows = thin_series(series, family.breaks, limit)
        time_ns, values = family.time_ns[rows], np.column_stack([one[rows] for one in series])
        breaks = family.breaks[rows[:-1]]
        if family.is_circular:
            breaks = breaks | wraps_after(values)
        recorder.lines(path, time_ns, values, lines, breaks, is_stepped=family.is_stepped)
        most = max(most, len(rows))
    views: list[rrb.View] = [
        plot(family.title, path, legend=len(family.fields) > 1) for family, path in zip(families, paths, strict=True)
    ]
    if len(views) > most_views:
        views[most_views - 1 :] = [plot(f"{len(views) - most_views + 1} more", paths[most_views - 1 :])]
    return most, views


def _lanes(recorder: Recorder, base: str, table_of_topic: Table) -> tuple[list[rrb.View], list[str]]:
    """Log texts and flags as lanes of their changes.

    Returns the views, and the fields that change too often for a lane.
    """
    fields = [name for name, column in table_of_topic.columns.items() if column.values.dtype.kind in "Ub"]
    paths, too_busy = [], []
    for field, part in zip(fields, path_parts(fields), strict=True):
        time_ns, states = _held(table_of_topic.time_ns, table_of_topic.columns[field])
        changes = runs(states)
        if len(changes) > MAX_LANE_ROWS:
            too_busy.append(field)
        elif (states != "").any():
            path = f"{base}/{STATES}/{part}"
            recorder.lane(path, time_ns[changes], states[changes].tolist(), colours.FLAGS)
            paths.append(path)
    return [lanes(f"{_title(table_of_topic.topic)} states", paths)] if paths else [], too_busy


def _held(time_ns: Int64Array, column: Column) -> tuple[Int64Array, np.ndarray]:
    """Return times and states of the rows that have the field, each held until the next.

    Empty after the last row before a gap. Rows of other sources lie between them: they end no state.
    """
    rows = np.flatnonzero(column.mask)
    values = np.where(column.values, "yes", "no") if column.values.dtype.kind == "b" else column.values
    times, states = time_ns[rows], values[rows].astype(np.str_)
    ends = np.flatnonzero(gap_after(times)) if column.present is not None else np.zeros(0, dtype=np.intp)
    return np.insert(times, ends + 1, times[ends] + 1), np.insert(states, ends + 1, "")


def _about(
    flight: Flight,
    families: dict[str, list[FieldFamily]],
    kept: dict[str, int],
    left_out: list[str],
    without_page: list[str],
) -> str:
    rows = []
    for topic, own in families.items():
        total = max((len(family) for family in own), default=len(flight[topic]))
        shown = "every row" if kept[topic] >= total or not own else f"{kept[topic]} of {total} rows"
        rows.append([markdown_text(topic), str(len(flight[topic])), str(sum(len(one.fields) for one in own)), shown])
    parts = [
        "# What is shown here",
        "Long topics are thinned for the screen: in every stretch the rows with the lowest and the highest value of "
        "each series are kept, and both sides of each gap. No value is altered. The MCAP beside this recording holds "
        "every row. Fields that only repeat the time of their row are not drawn; topics that are lists (parameters, "
        "definitions, single records) are tables.",
        table(["topic", "rows", "numeric fields", "shown"], rows),
    ]
    if left_out:
        names = ", ".join(markdown_text(name) for name in left_out)
        parts.append(f"Texts that change more than {MAX_LANE_ROWS} times have no lane and are not shown: {names}.")
    if without_page:
        names = ", ".join(markdown_text(topic) for topic in without_page)
        parts.append(f"{len(without_page)} topics beyond the first {MAX_TOPICS} have no page: {names}.")
    return "\n\n".join(parts)
