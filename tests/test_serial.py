"""Dataclasses to JSON and back: rounding, NaN, order, strictness with its place, and the lenient reading."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
import pytest

from groundstation.base.errors import UsageError
from groundstation.base.salvage import salvaged
from groundstation.base.serial import (
    LEFT_OUT_WHEN_DEFAULT,
    MismatchError,
    from_json,
    to_json,
    to_json_exactly,
)

NAN = float("nan")


@dataclass(frozen=True)
class Arrays:
    is_kept_apart: ClassVar[bool] = True
    values: tuple[float, ...]


@dataclass(frozen=True)
class Turn:
    kind: ClassVar[str] = "turn"
    rate_dps: float = 3.0


@dataclass(frozen=True)
class Climb:
    kind: ClassVar[str] = "climb"
    height_m: float = 0.0


@dataclass(frozen=True)
class Row:
    name: str
    error_deg: float
    note: str = field(default="", metadata=LEFT_OUT_WHEN_DEFAULT)
    samples: int = 0

    def __post_init__(self) -> None:
        if self.samples == 13:
            raise UsageError("samples", "13", "luck")


@dataclass(frozen=True)
class Answer:
    state: Literal["good", "bad"]
    limit: float | tuple[float, float]
    rows: tuple[Row, ...] = ()
    pair_m: tuple[float, float] = (0.0, 1.0)
    start_s: float | None = None
    best: Row | None = None
    settings: Mapping[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[Arrays, ...] = ()


ANSWER = Answer(
    "good",
    (0.5, 2.0),
    (Row("north", 1.23456789, "odd"), Row("east", NAN, samples=4)),
    (-0.0001, 1.0),
    best=Row("north", -0.00001),
    settings={"gate_deg": 1.23456, "draws": 400, "is_robust": True, "prior": "wide"},
    figures=(Arrays((1.0,)),),
)


def test_floats_are_rounded_by_their_names_and_fields_keep_their_order() -> None:
    plain = to_json(ANSWER)
    assert list(plain) == ["state", "limit", "rows", "pair_m", "start_s", "best", "settings"]
    north, east = plain["rows"]
    assert north == {"name": "north", "error_deg": 1.2346, "note": "odd", "samples": 0}
    assert list(north) == ["name", "error_deg", "note", "samples"]
    assert east == {"name": "east", "error_deg": None, "samples": 4}
    assert json.dumps([plain["pair_m"], plain["best"]["error_deg"]]) == "[[0.0, 1.0], 0.0]"  # never minus zero
    assert json.dumps(plain["settings"]) == '{"gate_deg": 1.2346, "draws": 400, "is_robust": true, "prior": "wide"}'
    assert to_json_exactly(ANSWER)["rows"][0]["error_deg"] == 1.23456789


def test_what_was_written_is_read_back_equal() -> None:
    plain = json.loads(json.dumps(to_json(ANSWER), allow_nan=False))
    back = from_json(Answer, plain)
    assert back.figures == () and back.limit == (0.5, 2.0) and type(back.settings["draws"]) is int
    assert math.isnan(back.rows[1].error_deg) and [row.name for row in back.rows] == ["north", "east"]
    assert to_json(back) == plain == to_json(from_json(Answer, {**plain, "of_a_later_version": 1}))


@pytest.mark.parametrize(
    ("spoiled", "place", "found"),
    [
        ({"state": "fair"}, "state", "'fair'"),
        ({"limit": "high"}, "limit", "'high'"),
        ({"limit": [1.0]}, "limit", "1 values"),
        ({"pair_m": [1.0, True]}, "pair_m[1]", "True"),
        ({"pair_m": {}}, "pair_m", "{}"),
        ({"start_s": "noon"}, "start_s", "'noon'"),
        ({"rows": [{"name": 3, "error_deg": 1.0}]}, "rows[0].name", "3"),
        ({"rows": [{"name": "north"}]}, "rows[0].error_deg", "nothing"),
        ({"best": {"name": "x", "error_deg": 0.0, "samples": 1.5}}, "best.samples", "1.5"),
        ({"best": {"name": "x", "error_deg": 0.0, "samples": 13}}, "best.samples", "13"),
        ({"best": [1]}, "best", "[1]"),
        ({"settings": {"gate_deg": [1]}}, "settings.gate_deg", "[1]"),
        ({"settings": 3}, "settings", "3"),
    ],
)
def test_a_value_of_another_kind_is_named_with_its_place(spoiled: dict[str, Any], place: str, found: str) -> None:
    with pytest.raises(MismatchError) as caught:
        from_json(Answer, {**to_json(ANSWER), **spoiled})
    assert (caught.value.place, caught.value.found) == (place, found)


def test_a_class_is_chosen_by_its_kind() -> None:
    @dataclass(frozen=True)
    class Route:
        legs: tuple[Turn | Climb, ...]

    assert from_json(Route, {"legs": [{"kind": "climb", "height_m": 5}, {"kind": "turn"}]}).legs == (Climb(5.0), Turn())
    with pytest.raises(MismatchError, match=r"legs\[0\]\.kind: found 'dive', expected one of turn, climb"):
        from_json(Route, {"legs": [{"kind": "dive"}]})


def test_what_is_sound_of_a_damaged_file_is_kept() -> None:
    @dataclass(frozen=True)
    class Kept:
        rows: tuple[Row, ...] = ()
        counts: Mapping[str, int] = field(default_factory=dict)
        share: float = 1.0

    good = {"name": "a", "error_deg": 1.0}
    bad: list[Any] = [7, {"name": "b"}, {"name": "c", "error_deg": 1e300}, {"name": "d", "error_deg": None}]
    found = salvaged(Kept, {"rows": [good, *bad], "counts": {"x": 1, "y": -1, "z": 1 << 70}, "share": "all"})
    assert found == Kept((Row("a", 1.0),), {"x": 1}, 1.0)
    assert salvaged(Kept, {"rows": 3, "counts": []}) == Kept()
    with pytest.raises(MismatchError, match="expected an object"):
        salvaged(Kept, [])


def test_numpy_values_are_written_as_plain_ones() -> None:
    values = {"a_m": np.float64(1.23456), "n": np.int64(3), "is_on": np.bool_(True), "x_m": np.array([1.0, np.inf])}
    assert json.dumps(to_json(values)) == '{"a_m": 1.235, "n": 3, "is_on": true, "x_m": [1.0, null]}'
