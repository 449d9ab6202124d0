"""UTIAS multi-robot data: one log for each file of a robot (.dat, also .dat.gz).

Odometry becomes ``odometry``, motion capture ``truth``, the camera ``link.<barcode>``; the robot is told by the name of
the file (``Robot3_Odometry.dat`` is of R3). Times are UTC. Angles and y of the data are to the left; here they are to
the right, so x is north and y is west. The "range" of the camera is kept as it is written: the distance along its
optical axis (docs/cooperative.md). Barcodes and landmarks are no logs: :func:`barcodes` and :func:`landmarks`.

Source: Leung, Halpern, Liu and Barfoot, The UTIAS multi-robot cooperative localization and mapping dataset,
International Journal of Robotics Research 30(8), 2011.
"""

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from groundstation.base.errors import UnclaimedLogError, UnreadableLogError
from groundstation.base.records import Damage, Int64Array, Item, LogHeader, RecordBatch, Remark
from groundstation.readers.dialect import Dialect, head_lines
from groundstation.readers.layout import LayoutRule, TableLayout, TimeRule
from groundstation.readers.losses import Losses
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Claim, Source

NAME = "utias"
MARK = b"# UTIAS Multi-Robot"
_CAMERA = "raw.camera"  # topic of the rows before they are split by the barcode seen
_ROBOT = re.compile(r"robot(\d+)_", re.IGNORECASE)
_DEG = float(np.rad2deg(1.0))
_RULES: dict[str, tuple[LayoutRule, ...]] = {
    "Odometry": (
        LayoutRule(1, "odometry", "speed_mps", "double"),
        LayoutRule(2, "odometry", "turn_rate_dps", "double", -_DEG),
    ),
    "Robot Groundtruth": (
        LayoutRule(1, "truth", "position_north_m", "double"),
        LayoutRule(2, "truth", "position_east_m", "double", -1.0),
        LayoutRule(3, "truth", "true_heading_deg", "double", -_DEG, is_heading=True),
    ),
    "Measurement": (
        LayoutRule(1, _CAMERA, "barcode", "double"),
        LayoutRule(2, _CAMERA, "pseudorange_m", "double"),
        LayoutRule(3, _CAMERA, "relative_bearing_deg", "double", -_DEG),
    ),
}
_TABLES = {"Barcode Data": 2, "Landmark Groundtruth": 5}  # tables of a data set and their columns; they are no logs
MOST_BARCODE = 999


class Landmark(NamedTuple):
    """Subject number and place of a landmark: x north, y west (so its east is negative)."""

    subject: int
    north_m: float
    east_m: float


def _kind(source: Source) -> str:
    """Return what a file of the data set holds, by the lines at its top.

    Empty for any other file.
    """
    if not source.head.removeprefix(b"\xef\xbb\xbf").startswith(MARK):
        return ""
    top = source.head[:2000].decode("utf-8", errors="replace")
    return next((kind for kind in (*_RULES, *_TABLES) if f"# {kind}" in top), "")


def sniff(source: Source) -> Claim | None:
    """Claim a file of a robot."""
    kind = _kind(source)
    if kind in _TABLES:
        raise UnclaimedLogError(source.name, f"the table {kind!r} of a UTIAS set, no log", "", "give it with its set")
    return Claim(NAME, kind.lower()) if kind else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches, remarks and damage of a file of a robot."""
    from groundstation.readers.table_reader import TableReader

    kind = _kind(source)
    if kind not in _RULES:
        raise UnreadableLogError(source.name, "no file of a robot of a UTIAS set")
    top = [line for line in head_lines(source, "utf-8") if line.text.startswith("#")]
    last = top[-1]
    dialect = Dialect("utf-8", "\t", len(_RULES[kind]) + 1, last.next_byte, last.number + 1)
    robot = _ROBOT.search(source.name)
    metadata = {"dataset": "UTIAS MRCLAM"} | ({"aircraft": f"R{robot.group(1)}"} if robot else {})
    header = LogHeader(f"{NAME} {kind.lower()}", metadata, 0)
    layout = TableLayout(TimeRule("seconds", (0,), ("Time [s]",)), _RULES[kind])
    items = TableReader(source, [TableSection(dialect, layout)]).items(header)
    yield next(items)
    if robot is None:
        yield Remark("no_robot", "the name of the file tells no robot: Robot<number>_... is expected")
    if kind == "Measurement":
        yield Remark("along_axis", "ranges are distances along the camera's optical axis, as written")
        yield from _by_barcode(items)
    else:
        yield from items


def _by_barcode(items: Iterator[Item]) -> Iterator[Item]:
    """Split the rows of the camera by barcode.

    Rows without a barcode are counted and left out.
    """
    losses = Losses()
    for item in items:
        if not isinstance(item, RecordBatch):
            yield item
            continue
        barcode, columns = item.columns["barcode"], dict(item.columns)
        del columns["barcode"]
        values = np.where(barcode.mask, barcode.values, -1.0)
        good = (values >= 0.0) & (values <= MOST_BARCODE) & (values == np.round(values))
        losses.add("unreadable_cells", "rows without a barcode", item.record_index[~good], where="Subject #")
        has_value = np.logical_or.reduce([column.mask for column in columns.values()])
        batch = RecordBatch(item.topic, item.record_index, item.device_time_ns, columns)
        for number in np.unique(values[good]).astype(int).tolist():
            rows: Int64Array = np.flatnonzero(good & has_value & (values == number))
            if len(rows):
                part = batch.take(rows)
                yield RecordBatch(f"link.{number}", part.record_index, part.device_time_ns, part.columns)
    yield from losses.damages()


def barcodes(source: Source) -> tuple[dict[int, int], tuple[Damage, ...]]:
    """Return the subject of each barcode, and damage for unreadable rows.

    Raises
    ------
    UnreadableLogError
        For another file, or one without a row.
    """
    rows, damages = _table(source, "Barcode Data")
    return {int(barcode): int(subject) for subject, barcode in rows}, damages


def landmarks(source: Source) -> tuple[tuple[Landmark, ...], tuple[Damage, ...]]:
    """Return the landmarks of a set, and damage for unreadable rows."""
    rows, damages = _table(source, "Landmark Groundtruth")
    return tuple(Landmark(int(row[0]), row[1], -row[2]) for row in rows), damages


def _table(source: Source, kind: str) -> tuple[list[list[float]], tuple[Damage, ...]]:
    if _kind(source) != kind:
        raise UnreadableLogError(source.name, "other text", f"the table {kind!r} of a UTIAS set")
    rows, losses = [], Losses()
    for line in head_lines(source, "utf-8"):
        cells = line.text.split()
        if not cells or line.text.startswith("#"):
            continue
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            row = []
        if len(row) != _TABLES[kind] or not np.isfinite(row).all() or row[0] != round(row[0]):
            losses.add("dropped_rows", f"rows that are none of {kind}", np.array([line.number]))
        else:
            rows.append(row)
    if not rows:
        raise UnreadableLogError(source.name, f"no row of {kind}", f"{_TABLES[kind]} numbers in a row")
    return rows, tuple(losses.damages())
