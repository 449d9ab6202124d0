"""Axes of an inertial unit: forward, right and down, by the one that reads gravity."""

import re
from collections.abc import Mapping
from dataclasses import replace

from groundstation.readers.drafts.column import ColumnGuess, both

# Up axis -> of each axis: the axis forward (x), right (y) or down (z) that it is along, and its sign.
_TURNED: Mapping[str, Mapping[str, tuple[str, int]]] = {
    "+z": {"x": ("x", 1), "y": ("y", -1), "z": ("z", -1)},
    "-z": {"x": ("x", 1), "y": ("y", 1), "z": ("z", 1)},
    "+y": {"z": ("x", -1), "x": ("y", 1), "y": ("z", -1)},
    "-y": {"z": ("x", 1), "x": ("y", 1), "y": ("z", 1)},
    "+x": {"z": ("x", 1), "y": ("y", 1), "x": ("z", -1)},
    "-x": {"y": ("x", 1), "z": ("y", 1), "x": ("z", 1)},
}
_BODY_AXES = {"forward": "x", "right": "y", "down": "z"}
_AXES_TOLD = {
    up: ", ".join(
        f"{'-' * (sign < 0)}{axis}" for _to, sign, axis in sorted((to, sign, axis) for axis, (to, sign) in axes.items())
    )
    for up, axes in _TURNED.items()
}


def turned(guess: ColumnGuess, up: str | None) -> ColumnGuess:
    """Return an axis of an inertial unit as forward, right or down, by what reads gravity.

    Other columns are returned as they are.

    Parameters
    ----------
    guess : ColumnGuess
    up : str or None
        Axis that reads gravity at rest, with its sign: ``+z``.
    """
    match = re.fullmatch(r"(imu\.rate|imu\.accel|magnetometer\.field)_([a-z]+)_(\w+)", guess.target)
    if not match:
        return guess
    is_field = match[1] == "magnetometer.field"
    if up is None:
        return replace(guess, doubt=both(guess.doubt, "axes forward, right, down assumed"))
    field, sign = _TURNED[up][_BODY_AXES.get(match[2], match[2])]
    names = {axis: name for name, axis in _BODY_AXES.items()}
    target = f"{match[1]}_{names[field] if is_field else field}_{match[3]}"
    reads = f"{up[1]} reads {up[0]}1 g: {_AXES_TOLD[up]} assumed to be forward, right, down"
    return replace(guess, target=target, sign=sign, doubt=both(guess.doubt, reads))
