"""The functions that readers take from below pyarrow.compute are those of pyarrow.compute."""

import importlib
import sys
from collections.abc import Callable
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pytest

from groundstation.base import arrow_compute

TEXT = pa.array([" N 12", "S 3,5", None, "", "+-4", "N 12"])
FLAGS = pa.array([True, False, None, True, False, True])
CALLS: dict[str, Callable[[Any], Any]] = {
    "all": lambda of: of.all(FLAGS, min_count=0),
    "all of none": lambda of: of.all(FLAGS[:0], min_count=0),
    "any": lambda of: of.any(FLAGS),
    "binary_join_element_wise": lambda of: of.binary_join_element_wise(TEXT, TEXT, ""),
    "cast": lambda of: of.cast(pa.array(["1.5", None]), pa.float64()),
    "cast by options": lambda of: of.cast(
        pa.array(["1.25"]), options=of.CastOptions(target_type=pa.decimal128(9, 1), allow_decimal_truncate=True)
    ),
    "coalesce": lambda of: of.coalesce(TEXT, TEXT[::-1]),
    "dictionary_encode": lambda of: of.dictionary_encode(TEXT),
    "dictionary_encode with nulls": lambda of: of.dictionary_encode(TEXT, null_encoding="encode"),
    "equal": lambda of: of.equal(TEXT, TEXT[3]),
    "extract_regex": lambda of: of.extract_regex(TEXT, r"(?P<side>[NS]) (?P<number>\d+)"),
    "fill_null": lambda of: of.fill_null(TEXT, TEXT[3]),
    "filter": lambda of: of.filter(TEXT, FLAGS),
    "if_else": lambda of: of.if_else(FLAGS, TEXT, TEXT[0]),
    "is_in": lambda of: of.is_in(TEXT, value_set=TEXT[:2]),
    "is_valid": lambda of: of.is_valid(TEXT),
    "match_substring_regex": lambda of: of.match_substring_regex(TEXT, r"^N"),
    "replace_substring": lambda of: of.replace_substring(pa.array(["1,2,3"]), ",", ".", max_replacements=1),
    "replace_substring everywhere": lambda of: of.replace_substring(pa.array(["1,2,3"]), ",", "."),
    "replace_substring_regex": lambda of: of.replace_substring_regex(TEXT, r"[+-]{2}", "-"),
    "starts_with": lambda of: of.starts_with(TEXT, "+-"),
    "struct_field": lambda of: of.struct_field(pc.extract_regex(TEXT, r"(?P<side>[NS])"), [0]),
    "utf8_lower": lambda of: of.utf8_lower(TEXT),
    "utf8_slice_codeunits": lambda of: of.utf8_slice_codeunits(TEXT, 0, 1),
    "utf8_trim_whitespace": lambda of: of.utf8_trim_whitespace(TEXT),
    "utf8_upper": lambda of: of.utf8_upper(TEXT),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_a_function_does_what_that_of_pyarrow_does(call: Callable[[Any], Any]) -> None:
    ours, theirs = call(arrow_compute), call(pc)
    assert ours.type == theirs.type
    assert ours.equals(theirs)


def test_every_function_is_compared() -> None:
    ours = {name for name, value in vars(arrow_compute).items() if callable(value) and not name.startswith("_")}
    assert ours - {"Any", "CastOptions"} == {name.split()[0] for name in CALLS}


def test_another_pyarrow_is_asked_by_its_public_functions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow._compute", None)
    monkeypatch.delattr(pa, "_compute")
    monkeypatch.setattr("groundstation.base.arrow_compute", arrow_compute)  # put back at the end
    monkeypatch.delitem(sys.modules, "groundstation.base.arrow_compute")
    anew = importlib.import_module("groundstation.base.arrow_compute")
    assert anew._arrow is pc
    assert anew.utf8_upper(pa.array(["n"])).to_pylist() == ["N"]
