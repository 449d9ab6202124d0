"""Words of the command line that need no conversion give what Typer makes of them; all others are left to Typer."""

from typing import Any

import pytest
from typer.models import ParameterInfo

from groundstation.cli.plain_words import _OtherError, plain
from tests.test_check import groundstation


@pytest.mark.parametrize(
    ("word", "kind", "expected"),
    [("4", int, 4), ("0", int | None, 0), ("007", int, 7), ("12", float, 12.0), (3, int, 3), (0.5, float, 0.5)],
)
def test_a_whole_number_is_taken_as_it_stands(word: Any, kind: Any, expected: float) -> None:
    taken = plain(word, kind, ParameterInfo(min=0, max=65535))
    assert (taken, type(taken)) == (expected, type(expected))


@pytest.mark.parametrize(
    ("word", "about"),
    [
        *((one, ParameterInfo()) for one in ("-1", "1e3", "\u0663", "1_000", "12345678901234567890")),
        *(("0", ParameterInfo(min=1)), ("70000", ParameterInfo(max=65535))),
    ],
)
def test_other_numbers_are_left_to_typer(word: str, about: ParameterInfo) -> None:
    with pytest.raises(_OtherError):
        plain(word, int, about)


def test_a_number_out_of_range_is_refused_as_ever() -> None:
    code, _, error = groundstation("run", "nothing.csv", "-o", "out", "-j", "-1")
    assert code == 2
    assert "greater than or equal to" in error
