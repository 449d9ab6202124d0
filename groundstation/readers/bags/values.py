"""Columns of a decoded block as numbers, and the frames of ROS turned into ours.

ROS has east-north-up and body axes forward-left-up (REP 103); we have north-east-down and forward-right-down.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.records import BoolArray, Column
from groundstation.base.units import DEG_PER_RAD
from groundstation.readers.mapping import Columns


class Values:
    """Columns by name, as floating-point numbers; NaN where a message lacks the field.

    Texts are no numbers.

    Parameters
    ----------
    columns : mapping of name to Column
    """

    def __init__(self, columns: Mapping[str, Column]) -> None:
        self._columns = columns
        self._rows = len(next(iter(columns.values()))) if columns else 0

    def __len__(self) -> int:
        return self._rows

    def __contains__(self, name: str) -> bool:
        return name in self._columns

    def __getitem__(self, name: str) -> FloatArray:
        column = self._columns[name]
        if column.values.dtype.kind == "U":
            raise KeyError(name)
        with np.errstate(invalid="ignore"):
            values = column.values.astype(np.float64)
        return values if column.present is None else np.where(column.present, values, np.nan)

    def column(self, name: str) -> Column:
        """A column as it was decoded."""
        return self._columns[name]

    def items(self) -> Iterator[tuple[str, Column]]:
        """All columns with their names."""
        yield from self._columns.items()

    def text(self, name: str) -> str:
        """The first text of a column; empty where there is none."""
        column = self._columns.get(name)
        return str(column.values[0]) if column is not None and len(column) and column.values.dtype.kind == "U" else ""

    def triple(self, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """x, y and z of a vector."""
        return self[f"{name}.x"], self[f"{name}.y"], self[f"{name}.z"]

    def has_triple(self, name: str) -> bool:
        """Tell whether the columns have a vector of that name."""
        return all(f"{name}.{axis}" in self for axis in "xyz")


def attitude(values: Values, name: str, present: BoolArray | None, *, is_turned: bool = True) -> Columns:
    """Return roll, pitch and heading of a quaternion.

    It turns body forward-left-up into east-north-up.

    heading = 90 deg - yaw, pitch = -pitch of ROS, roll = roll of ROS. Without ``is_turned`` the axes are
    forward-right-down and north-east-down already. A quaternion whose length is not one is none: drivers write zeros
    for what they do not know.

    Examples
    --------
    >>> yaw = np.deg2rad(30.0)  # 30 deg left of east: heading 60
    >>> parts = {"q.x": 0.0, "q.y": 0.0, "q.z": np.sin(yaw / 2), "q.w": np.cos(yaw / 2)}
    >>> one = Values({name: Column(np.array([value])) for name, value in parts.items()})
    >>> {name: round(float(column.values[0]), 6) for name, column in attitude(one, "q", None).items()}
    {'roll_deg': 0.0, 'pitch_deg': -0.0, 'true_heading_deg': 60.0}
    """
    x, y, z = values.triple(name)
    w = values[f"{name}.w"]
    with np.errstate(invalid="ignore", over="ignore"):
        is_one = np.abs(w * w + x * x + y * y + z * z - 1.0) < 0.1
        present = is_one if present is None else present & is_one
        roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)) * DEG_PER_RAD
        pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)) * DEG_PER_RAD
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)) * DEG_PER_RAD
        heading = wrap_360(np.where(present, 90.0 - yaw if is_turned else yaw, 0.0))
    return {
        "roll_deg": Column(np.where(present, roll, 0.0), present),
        "pitch_deg": Column(np.where(present, -pitch if is_turned else pitch, 0.0), present),
        "true_heading_deg": Column(np.asarray(heading), present),
    }


def body(
    values: Values,
    name: str,
    fields: tuple[str, str, str],
    factor: float,
    present: BoolArray | None,
    *,
    is_turned: bool = True,
) -> Columns:
    """Turn a vector along forward, left and up to forward, right and down.

    It stays as it is without ``is_turned``.
    """
    signs = (1.0, -1.0, -1.0) if is_turned else (1.0, 1.0, 1.0)
    parts = zip(fields, values.triple(name), signs, strict=True)
    return {field: Column(sign * factor * part, present) for field, part, sign in parts}


def level(east: FloatArray, north: FloatArray, up: FloatArray, fields: tuple[str, str, str]) -> Columns:
    """Return a vector along east, north and up as fields along north, east and down.

    Absent where it is NaN.
    """
    return {
        name: Column(np.where(np.isnan(part), 0.0, part), ~np.isnan(part))
        for name, part in zip(fields, (north, east, -up), strict=True)
    }


def rotated(values: Values, quaternion: str, vector: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rotate a vector of the body into the axes that its quaternion refers to."""
    x, y, z = values.triple(quaternion)
    w = values[f"{quaternion}.w"]
    a, b, c = values.triple(vector)
    with np.errstate(invalid="ignore", over="ignore"):
        return (
            (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - w * z) * b + 2 * (x * z + w * y) * c,
            2 * (x * y + w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - w * x) * c,
            2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c,
        )
