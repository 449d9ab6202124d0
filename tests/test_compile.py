"""Compiled loops: the answers of the plain functions, kept as machine code that needs no numba to be found again."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from groundstation.base import compile as compiling
from groundstation.base.compile import Loop, compiled, in_place
from groundstation.base.machine_code import KeptCode, digest_of, forms_of

WEIGHT = 3


@in_place
def _weighted(value: int) -> int:
    return WEIGHT * value


@in_place
def total(table: np.ndarray, first: int, out: np.ndarray) -> int:
    """Weighted sum of a table from a row on; sums of its rows go to ``out``."""
    found = 0
    for row in range(first, table.shape[0]):
        for column in range(table.shape[1]):
            out[row] += table[row, column]
            found += _weighted(table[row, column])
    return found


@in_place
def is_above(values: np.ndarray, limit: float) -> bool:
    """Whether any value is above a limit."""
    for value in values:  # noqa: SIM110 -- as compiled loops are written
        if value > limit:
            return True
    return False


@compiled
def mean(values: np.ndarray) -> float:
    """Mean of values."""
    return np.mean(values)


@pytest.fixture
def kept_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of compiled code of its own, and loops that have found nothing yet."""
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path)
    for loop in (total, is_above):
        monkeypatch.setattr(loop, "_linked", {})
    return tmp_path


def test_a_loop_answers_as_its_plain_function(kept_here: Path) -> None:
    table = np.arange(12).reshape(4, 3)
    sums = np.zeros(4)
    assert total(table, 1, sums) == WEIGHT * table[1:].sum()
    np.testing.assert_array_equal(sums, [0.0, *table[1:].sum(axis=1)])
    assert is_above(np.array([1.0, 2.0]), 1.5) is True and is_above(np.array([1.0]), 1.5) is False
    assert len(list(kept_here.glob("*.machine_code"))) == 2


def test_arrays_with_gaps_are_left_to_numba(kept_here: Path) -> None:
    table = np.arange(24).reshape(4, 6)
    assert total(table[:, ::2], 0, np.zeros(4)) == WEIGHT * table[:, ::2].sum()
    assert mean(np.array([1.0, 3.0])) == 2.0
    assert not list(kept_here.glob("*.machine_code"))


def test_kept_code_is_found_without_numba(tmp_path: Path) -> None:
    program = (
        "import sys, numpy as np\nfrom tests.test_compile import total\n"
        "print(total(np.ones((2, 2), np.int64), 0, np.zeros(2)), 'numba' in sys.modules)"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    said = [
        subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True)
        for _ in range(2)
    ]
    assert [one.stdout.split() for one in said] == [["12", "True"], ["12", "False"]]


def test_damaged_code_is_compiled_again(kept_here: Path) -> None:
    forms = forms_of((np.zeros((1, 1), np.int64), 0, np.zeros(1)))
    kept = KeptCode(kept_here, total.py_func, forms)
    total(np.ones((2, 2), np.int64), 0, np.zeros(2))
    (file,) = kept_here.glob("*.machine_code")
    whole = file.read_bytes()
    for damaged in (whole[:-1], whole[:100] + bytes([whole[100] ^ 1]) + whole[101:], b""):
        file.write_bytes(damaged)
        assert kept.read() is None
    file.write_bytes(whole)
    assert kept.read() is not None


def test_what_a_loop_calls_and_its_constants_tell_its_code_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    before = digest_of(total.py_func, ())
    monkeypatch.setitem(globals(), "WEIGHT", 4)
    of_another_weight = digest_of(total.py_func, ())
    monkeypatch.setitem(globals(), "_weighted", Loop(lambda value: value, {"_nrt": False}))
    assert len({before, of_another_weight, digest_of(total.py_func, ())}) == 3
