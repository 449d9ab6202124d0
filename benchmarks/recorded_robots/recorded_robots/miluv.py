"""MILUV ultra-wideband ranges (range_data.csv): one log of several quadrotors, with poses.

The poses are by motion capture.

A range from tag 10 to tag or anchor 31 is a row of ``link.10-31``; the pose of ifo001 is ``truth.ifo001``. World axes
of the data have z up and bodies forward-left-up; here both are turned by 180 deg about x. Columns that no rule names
are kept under ``raw.miluv``, among them ``gt_range`` and ``bias``, which are wrong in some versions of the file (the
true range is that of the poses). Other files of the set (tags.yaml, anchors.yaml) tell which vehicle carries which tag:
:func:`arms` reads them.

Source: Shalaby, Ahmed, Dahdah, Cossette, Le Ny and Forbes, MILUV: a multi-UAV indoor localization dataset with UWB and
vision, 2025 (arXiv 2504.14376).
"""

import re
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_360
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import BoolArray, Column, Item, LogHeader, RecordBatch, Remark
from groundstation.readers.dialect import Dialect, HeadLine, head_lines, split_cells
from groundstation.readers.layout import LayoutRule, TableLayout, TimeRule
from groundstation.readers.losses import Losses
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Claim, Source

NAME = "miluv"
RAW = "raw.miluv"
RANGE, ENDS, TIME = "range", ("from_id", "to_id"), "timestamp"
PLACE, TURN = "r_iw_a_", "q_ai_"  # + name of the vehicle
MOST_ID = 9999
FloatArray = NDArray[np.float64]
_ENTRY = re.compile(r"""^\s+["']?(\w+)["']?\s*:\s*["']?\[([^\]]*)\]""")
_GROUP = re.compile(r"""^["']?(\w+)["']?\s*:\s*$""")


def _header(source: Source) -> tuple[HeadLine, list[str]] | None:
    """Return the header row, if it is that of this format."""
    lines = head_lines(source, "utf-8", 1)
    names = split_cells(lines[0].text, ",") if lines else []
    wanted = {RANGE, *ENDS, TIME}
    return (lines[0], names) if wanted.issubset(names) and any(name.startswith(PLACE) for name in names) else None


def sniff(source: Source) -> Claim | None:
    """Claim a table with ranges between numbered tags and the poses of their vehicles."""
    return Claim(NAME) if _header(source) is not None else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches, remarks and damage."""
    from groundstation.readers.table_reader import TableReader, truncated_header

    found = _header(source)
    if found is None:
        raise UnreadableLogError(source.name, "no MILUV ranges", f"columns {RANGE}, {', '.join(ENDS)}, {TIME}")
    line, names = found
    vehicles = [name.removeprefix(PLACE) for name in names if name.startswith(PLACE)]
    header = LogHeader(NAME, {"dataset": "MILUV", "vehicles": ", ".join(vehicles)}, 0)
    if not line.ended:
        yield header
        yield truncated_header(line.number)
        return
    poses = {f"{start}{vehicle}" for vehicle in vehicles for start in (PLACE, TURN)}
    rules = tuple(
        LayoutRule(at, RAW, name, "text" if name in poses else "double" if name in (RANGE, *ENDS) else "raw")
        for at, name in enumerate(names)
        if name and name != TIME
    )
    time = TimeRule("seconds", (names.index(TIME),), (TIME,))
    dialect = Dialect("utf-8", ",", len(names), line.next_byte, 2)
    items = TableReader(source, [TableSection(dialect, TableLayout(time, rules))]).items(header)
    yield next(items)
    yield Remark("no_truth_range", "gt_range and bias are kept raw: the true range is that of the poses")
    losses = Losses()
    for item in items:
        if isinstance(item, RecordBatch):
            yield from _parted(item, vehicles, losses)
        else:
            yield item
    yield from losses.damages()


def _parted(batch: RecordBatch, vehicles: list[str], losses: Losses) -> Iterator[RecordBatch]:
    """Split a batch of rows into links, poses and the rest."""
    columns = dict(batch.columns)
    distance, ends = columns.pop(RANGE), [columns.pop(name) for name in ENDS]
    ids = [np.where(end.mask, end.values, -1.0) for end in ends]
    good = np.logical_and.reduce([(one >= 0.0) & (one <= MOST_ID) & (one == np.round(one)) for one in ids])
    losses.add("unreadable_cells", "rows without two tags", batch.record_index[~good], where=", ".join(ENDS))
    one_id, other_id = (np.where(good, one, 0.0) for one in ids)
    key = np.where(good, one_id * (MOST_ID + 1) + other_id, -1.0)
    for number in np.unique(key[good & distance.mask]).astype(int).tolist():
        one, two = divmod(number, MOST_ID + 1)
        rows = np.flatnonzero((key == number) & distance.mask)
        yield _of(batch, rows, f"link.{one}-{two}", {"pseudorange_m": distance})
    for vehicle in vehicles:
        pose, present = _pose(columns.pop(f"{PLACE}{vehicle}", None), columns.pop(f"{TURN}{vehicle}", None), len(batch))
        losses.add("unreadable_cells", "poses that cannot be read", batch.record_index[~present], where=vehicle)
        if present.any():
            yield _of(batch, np.flatnonzero(present), f"truth.{vehicle}", pose)
    if columns and (occupied := np.logical_or.reduce([column.mask for column in columns.values()])).any():
        yield _of(batch, np.flatnonzero(occupied), RAW, columns)


def _of(batch: RecordBatch, rows: NDArray[np.intp], topic: str, columns: Mapping[str, Column]) -> RecordBatch:
    return RecordBatch(topic, batch.record_index, batch.device_time_ns, columns).take(rows)


def _pose(place: Column | None, turn: Column | None, n: int) -> tuple[dict[str, Column], BoolArray]:
    """Position and attitude of a vehicle in north-east-down, and where they can be read."""
    position, quaternion = _vectors(place, 3, n), _vectors(turn, 4, n)
    with np.errstate(invalid="ignore", over="ignore"):
        norm = np.linalg.norm(quaternion, axis=1)
    present: BoolArray = np.isfinite(position).all(axis=1) & (np.abs(norm - 1.0) < 0.1)
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, z, w = (quaternion / norm[:, None]).T
        y, z = -y, -z  # axes turned by 180 deg about x
        roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
        heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    values = {
        "position_north_m": position[:, 0],
        "position_east_m": -position[:, 1],
        "position_down_m": -position[:, 2],
        "roll_deg": np.rad2deg(roll),
        "pitch_deg": np.rad2deg(pitch),
        "true_heading_deg": wrap_360(np.rad2deg(heading)),
    }
    return {name: Column(value) for name, value in values.items()}, present


def _vectors(column: Column | None, size: int, n: int) -> FloatArray:
    """Parse cells such as ``[1.0 2.0 3.0]`` into rows, shape (n, size).

    NaN where a cell is anything else.
    """
    out = np.full((n, size), np.nan)
    if column is None:
        return out
    for row, (cell, is_there) in enumerate(zip(column.values.tolist(), column.mask.tolist(), strict=True)):
        parts = cell.strip("[] ").replace(",", " ").split() if is_there else []
        if len(parts) == size:
            try:
                out[row] = [float(part) for part in parts]
            except ValueError:
                continue
    return out


def arms(source: Source) -> dict[str, dict[int, tuple[float, float, float]]]:
    """Read the positions of tags by vehicle, or of anchors by constellation.

    Tags are in the vehicle's axes forward-right-down, anchors in north-east-down.

    Raises
    ------
    UnreadableLogError
        When nothing in the file is such a list.
    """
    groups: dict[str, dict[int, tuple[float, float, float]]] = {}
    group = ""
    for line in head_lines(source, "utf-8"):
        if heading := _GROUP.match(line.text):
            group = heading.group(1)
        elif (entry := _ENTRY.match(line.text)) and entry.group(1).isdigit():
            try:
                x, y, z = (float(part) for part in entry.group(2).split(","))
            except ValueError:
                continue
            groups.setdefault(group, {})[int(entry.group(1))] = (x, -y, -z)
    if not groups:
        raise UnreadableLogError(source.name, "no places of tags or anchors", 'lines such as  "10": "[0.1, -0.2, 0.0]"')
    return groups
