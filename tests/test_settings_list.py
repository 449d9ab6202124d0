"""Every setting as `list --settings` tells it: what the code holds, and nothing else."""

import dataclasses
import json
from typing import Literal

from groundstation.base.toml_settings import number, settings_from
from groundstation.pipeline.verbs.settings_list import every_setting, meanings, settings_of
from groundstation.systems import systems
from tests.test_cli import groundstation

FEWEST_WORDS = 2


@dataclasses.dataclass(frozen=True)
class Inner:
    width_m: float = number(2.5, 0.0, 10.0)  # of a bar


@dataclasses.dataclass(frozen=True)
class Outer:
    """Example.

    Parameters
    ----------
    speed_max_mps : float
        Said by the docstring,
        in two lines.
    """

    speed_max_mps: float = number(3.0, 0.0)
    # A title of four words
    far_m: float = number(1.0)  # behind the field
    # Title
    kind: Literal["a", "b"] = "a"
    # Above the field stands what it is about.
    lag_s: float | None = number(None, -1.0, 1.0)
    inner: Inner = Inner(4.0)  # Two words


def test_a_setting_is_told_with_all_that_the_code_says() -> None:
    found = {f"{one.table}.{one.key}": one for one in settings_of("outer", Outer)}
    assert list(found) == ["outer.speed_max_mps", "outer.far_m", "outer.kind", "outer.lag_s", "outer.inner.width_m"]
    speed = found["outer.speed_max_mps"]
    assert (speed.unit, speed.default, speed.allowed) == ("m/s", "3", "0 or more")
    assert speed.meaning == "Said by the docstring, in two lines."
    assert (found["outer.kind"].allowed, found["outer.kind"].meaning) == ("a, b", "")
    assert found["outer.lag_s"].meaning == "Above the field stands what it is about."
    assert (found["outer.lag_s"].default, found["outer.lag_s"].allowed) == ("", "-1 to 1")
    assert found["outer.far_m"].meaning == "behind the field"
    width = found["outer.inner.width_m"]
    assert (width.default, width.meaning) == ("4", "Two words: of a bar")
    assert meanings(Inner) == {"width_m": "of a bar"}


def test_every_setting_has_a_meaning() -> None:
    every = every_setting()
    bare = [f"{one.table}.{one.key}" for one in every if len(one.meaning.split()) < FEWEST_WORDS]
    assert len(every) > 500 and not bare, f"say what they do, behind the field: {bare}"


def test_defaults_that_are_told_can_be_written_into_a_file() -> None:
    for analysis in systems().analyses:
        rows = [one for one in settings_of(analysis.settings_table, analysis.settings) if "." not in one.table]
        numbers = {one.key: float(one.default) for one in rows if one.default.replace(".", "", 1).isdigit()}
        whole = {name: int(value) if value.is_integer() else value for name, value in numbers.items()}
        settings_from(analysis.settings, whole, "told.toml")


def test_defaults_of_a_table_inside_are_those_that_stand() -> None:
    found = {f"{one.table}.{one.key}": one for one in every_setting()}
    assert found["landing.criteria.touchdown.at_most"].default == "914.4", "the first 3000 ft"
    assert found["landing.criteria.tailwind.at_most"].default == "5.14444444444", "10 kt"
    assert found["landing.criteria.flare.at_most"].default == ""


def test_the_list_is_printed() -> None:
    code, out, _ = groundstation("list", "--settings")
    assert code == 0 and "[heading]" in out and "taxi_speed_min_mps" in out
    code, out, _ = groundstation("list", "--settings", "--json")
    rows = json.loads(out)
    assert code == 0 and len(rows) == len(every_setting()) > 500
    assert {"table", "key", "unit", "default", "allowed", "meaning"} == set(rows[0])
    assert groundstation("list", "a.csv", "--settings")[0] == 2
