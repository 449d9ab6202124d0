"""Drift of the ground speed that honest units hardly exceed while they stand.

``alignment_limits.toml`` beside this file has it by class and length of the stand, written by
``python -m groundstation.systems.inertial.study.ground_limits``.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.toml_text import toml_table

FILE = "alignment_limits.toml"


@cache
def _table() -> dict[str, Any]:
    text = Path(__file__).with_name(FILE).read_text(encoding="utf-8")
    return toml_table(text, FILE, "limits of the drift while standing")


def standing_limit_mps2(ins_class: str, length_s: float) -> float | None:
    """Return the length of the velocity slope of a class, None for one that was not simulated.

    Limits of other lengths are interpolated, and held beyond the ends.
    """
    table = _table()
    found = table["slope_mps2"].get(ins_class)
    return None if found is None else float(np.interp(length_s, table["length_s"], found))
