"""Compiled loops: the answers of the plain functions, kept as machine code that needs no numba to be found again."""

import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from groundstation.base import compile as compiling
from groundstation.base.compile import SMALL_BYTES, Loop, compiled, in_place, scanner, why_nothing_is_kept
from groundstation.base.machine_code import KeptCode, digest_of, forms_of
from groundstation.base.own_files import hand_of_others, read_own, write_own

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


@in_place
def sign(value: int) -> float:
    """Sign of a number."""
    return 1.0 if value > 0 else -1.0


@in_place
def beyond(shape_of: np.ndarray, row: int) -> int:
    """Rows of a table behind one; its values are not looked at."""
    return shape_of.shape[0] - row - 1


@scanner
def count_of(data: np.ndarray, wanted: int, weights: np.ndarray) -> int:
    """Weighted number of bytes of a value; ``weights`` are used up."""
    found = 0
    for byte in data:
        if byte == wanted:
            found += _weighted(weights[0])
    weights[0] = 0
    return found


class Limits(NamedTuple):
    """What :func:`inside` is handed."""

    low: float
    highs: np.ndarray
    steps: tuple[int, ...]


@in_place
def _narrow(low: float) -> float:
    return Limits(low, np.zeros(1), (1,)).low


@in_place
def inside(values: np.ndarray, limits: Limits) -> int:
    """How many values, taken in steps, lie between the limits."""
    found = k = 0
    while k < len(values):
        found += limits.low < values[k] < limits.highs[k]
        k += limits.steps[0]
    return found


@in_place
def in_steps(values: np.ndarray, step: int) -> float:
    """Sum of every so many values; a step of 0 is an error."""
    found = 0.0
    for k in range(0, len(values), step):
        found += values[k]
    return found


@compiled
def mean(values: np.ndarray) -> float:
    """Mean of values."""
    return np.mean(values)


@pytest.fixture
def kept_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of compiled code of its own, and loops that have found nothing yet."""
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path)
    monkeypatch.setattr(compiling, "_refused", [])
    for loop in (total, is_above, inside, in_steps, sign, beyond, count_of):
        monkeypatch.setattr(loop, "_linked", {})
        monkeypatch.setattr(loop, "_is_missing", {})
        for compiled_before in ("_part", "_ordinary"):  # with the numba of another test
            vars(loop).pop(compiled_before, None)
    return tmp_path


def test_a_loop_answers_as_its_plain_function(kept_here: Path) -> None:
    table = np.arange(12).reshape(4, 3)
    sums = np.zeros(4)
    assert total(table, 1, sums) == WEIGHT * table[1:].sum()
    np.testing.assert_array_equal(sums, [0.0, *table[1:].sum(axis=1)])
    assert is_above(np.array([1.0, 2.0]), 1.5) is True and is_above(np.array([1.0]), 1.5) is False
    assert len(list(kept_here.glob("*.machine_code"))) == 2


def test_tuples_are_handed_on_by_name(kept_here: Path) -> None:
    values = np.arange(10.0)
    assert inside(values, Limits(2.0, values + 1.0, (3, 0))) == 3  # of 0, 3, 6, 9
    assert inside(values, Limits(3.0, np.full(10, 9.0), (3, 0))) == 1
    assert len(list(kept_here.glob("*.machine_code"))) == 1
    assert not compiling.keeps_nothing()


def test_a_folder_without_compiled_code_is_that_of_a_first_run(kept_here: Path) -> None:
    assert compiling.keeps_nothing()


def test_a_user_without_a_home_keeps_no_compiled_code(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home(_path: Path) -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(compiling, "_is_writable", lambda _folder: False)
    monkeypatch.setattr(Path, "expanduser", no_home)
    assert compiling._cache_folder.__wrapped__() is None
    monkeypatch.setattr(compiling, "_cache_folder", lambda: None)
    monkeypatch.setattr(is_above, "_linked", {})
    assert is_above(np.array([1.0, 2.0]), 1.5)


def test_a_few_bytes_are_gone_through_in_plain_python_until_there_is_code(
    kept_here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def count(size: int) -> int:
        weights = np.array([2])
        answer = count_of(np.ones(size, np.uint8), 1, weights)
        assert weights[0] == 0
        assert type(answer) is int
        return answer // (2 * WEIGHT)

    ran: list[int] = []
    plain = Loop._run_plain
    monkeypatch.setattr(Loop, "_run_plain", lambda loop, given: (ran.append(len(given[0])), plain(loop, given))[1])
    monkeypatch.setattr(compiling, "PLAIN_S", 10.0)
    assert count(SMALL_BYTES) == SMALL_BYTES and ran == [SMALL_BYTES] and not list(kept_here.iterdir())
    monkeypatch.setattr(count_of, "_plain_s", 10.0)  # enough of that
    assert count(5) == 5 and len(list(kept_here.iterdir())) == 1
    monkeypatch.setattr(count_of, "_plain_s", 0.0)
    assert count(6) == 6 and count(SMALL_BYTES + 1) == SMALL_BYTES + 1
    monkeypatch.setattr(count_of, "_linked", {})  # as in another process
    monkeypatch.setattr(count_of, "_is_missing", {})
    assert count(7) == 7 and ran == [SMALL_BYTES]


def test_a_loop_that_may_fail_is_left_to_numba_which_tells_the_error(kept_here: Path) -> None:
    assert in_steps(np.arange(5.0), 2) == 6.0
    with pytest.raises(ValueError, match="zero"):
        in_steps(np.arange(5.0), 0)
    assert not list(kept_here.glob("*.machine_code"))


def test_arrays_with_gaps_are_left_to_numba(kept_here: Path) -> None:
    table = np.arange(24).reshape(4, 6)
    assert total(table[:, ::2], 0, np.zeros(4)) == WEIGHT * table[:, ::2].sum()
    assert mean(np.array([1.0, 3.0])) == 2.0
    assert not list(kept_here.glob("*.machine_code"))


def test_numbers_that_the_machine_code_does_not_take_are_never_misread(kept_here: Path) -> None:
    assert sign(2**63) == 1.0 and sign(np.uint64(2**64 - 1)) == 1.0 and sign(np.bool_(True)) == 1.0
    assert forms_of((np.zeros(3).astype(np.dtype("f8").newbyteorder()),)) is None
    assert not list(kept_here.glob("*.machine_code"))


def test_an_array_that_is_only_read_may_be_read_only_and_one_that_is_written_may_not(kept_here: Path) -> None:
    table, out = np.ones((2, 2), np.int64), np.zeros(2)
    table.flags.writeable = False
    assert total(table, 0, out) == 4 * WEIGHT and out.tolist() == [2.0, 2.0]
    out.flags.writeable = False
    with pytest.raises(Exception, match="readonly"):
        total(table, 0, out)
    assert out.tolist() == [2.0, 2.0]
    highs = np.full(4, 9.0)
    highs.flags.writeable = False
    assert inside(highs - 1.0, Limits(2.0, highs, (1,))) == 4


def test_an_array_that_is_not_even_read_may_be_read_only(kept_here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = np.ones((4, 2))
    table.flags.writeable = False
    assert beyond(table, 1) == 2
    (linked,) = beyond._linked.values()
    assert not linked.would_write((table, 1))


NOT_DOCUMENTED = ("_nrt", "no_cfunc_wrapper", "forceinline")  # options of numba, but one that it sets itself


@pytest.mark.parametrize("changed", ["its options", "its text of a loop", "llvmlite"])
def test_a_numba_that_lacks_what_it_does_not_document_gives_the_same_answers(
    kept_here: Path, monkeypatch: pytest.MonkeyPatch, changed: str
) -> None:
    from llvmlite import binding
    from numba.core.ccallback import CFunc
    from numba.core.cpu import CPUTargetOptions
    from numba.core.dispatcher import Dispatcher

    if changed == "its options":
        for name in NOT_DOCUMENTED:
            monkeypatch.delattr(next(one for one in CPUTargetOptions.__mro__ if name in vars(one)), name)
    elif changed == "its text of a loop":
        monkeypatch.delattr(CFunc, "inspect_llvm")
    else:
        monkeypatch.delattr(binding, "JITLibraryBuilder")
    monkeypatch.delattr(Dispatcher, "stats")
    assert why_nothing_is_kept() == ""
    monkeypatch.setattr(compiling, "PLAIN_S", 0.0)
    for loop in (total, inside, count_of, sign, mean, _weighted):
        for compiled_before in ("_part", "_ordinary"):
            monkeypatch.delitem(vars(loop), compiled_before, raising=False)
    table, sums, values = np.arange(12).reshape(4, 3), np.zeros(4), np.arange(10.0)
    assert total(table, 1, sums) == WEIGHT * table[1:].sum()
    assert sums.tolist() == [0.0, *table[1:].sum(axis=1)]
    assert inside(values, Limits(2.0, values + 1.0, (3, 0))) == 3
    assert count_of(np.ones(5, np.uint8), 1, np.array([2])) == 5 * 2 * WEIGHT
    assert sign(-1) == -1.0 and mean(values) == 4.5
    assert not list(kept_here.glob("*.machine_code"))
    assert why_nothing_is_kept().startswith("compiled code is not kept (total: ")
    assert total._ordinary.signatures


def test_a_loop_is_pickled_by_its_name(kept_here: Path) -> None:
    assert pickle.loads(pickle.dumps(total)) is total


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
    monkeypatch.setitem(globals(), "_weighted", Loop(lambda value: value))
    assert len({before, of_another_weight, digest_of(total.py_func, ())}) == 3
    before = digest_of(_narrow.py_func, ())
    monkeypatch.setitem(globals(), "Limits", NamedTuple("Limits", [("highs", float), ("low", float)]))
    assert digest_of(_narrow.py_func, ()) != before


NOBODY = 65_534
needs_root = pytest.mark.skipif(
    getattr(os, "geteuid", lambda: 1)() != 0, reason="only root gives a file to another user"
)


@pytest.fixture
def passed() -> Iterator[Path]:
    """A folder that others may pass, on a path that they may not write to."""
    folder = Path(tempfile.mkdtemp()).resolve()
    folder.chmod(0o755)
    if reason := hand_of_others(folder):
        pytest.skip(reason)
    yield folder
    shutil.rmtree(folder)


def test_a_folder_of_our_own_serves_and_one_that_others_may_write_does_not(passed: Path) -> None:
    folder = passed / "kept"
    folder.mkdir(mode=0o755)
    assert hand_of_others(folder) == ""
    for mode in (0o770, 0o707, 0o1777):
        folder.chmod(mode)
        assert hand_of_others(folder) == f"others may write into {folder}"
    inside = folder / "inside"
    inside.mkdir()
    inside.chmod(0o777)
    folder.chmod(0o700)
    assert hand_of_others(inside) == ""  # others cannot pass the folder above it


def test_a_folder_that_others_may_exchange_does_not_serve(passed: Path) -> None:
    kept, link = passed / "kept", passed.with_name(f"{passed.name}-link")
    kept.mkdir(mode=0o755)
    passed.chmod(0o777)
    assert hand_of_others(kept) == f"others may write into {passed}"
    passed.chmod(0o1777)  # as /tmp: entries of others cannot be exchanged
    assert hand_of_others(kept) == ""
    link.symlink_to(kept)
    try:
        assert hand_of_others(link) == ""
        passed.chmod(0o777)
        assert hand_of_others(link) == f"others may write into {passed}"
    finally:
        link.unlink()


@needs_root
def test_nothing_is_kept_in_the_folder_of_another_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "kept"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    assert compiling._cache_folder.__wrapped__() == folder
    os.chown(folder, NOBODY, NOBODY)
    assert compiling._cache_folder.__wrapped__() is None
    monkeypatch.setattr(compiling, "_cache_folder", lambda: None)
    assert f"{folder} is another user's" in compiling.why_nothing_is_kept()


@pytest.mark.parametrize("harm", ["owner", "mode", "link"])
def test_code_that_another_may_have_written_is_not_loaded(kept_here: Path, harm: str) -> None:
    kept = KeptCode(kept_here, total.py_func, forms_of((np.zeros((1, 1), np.int64), 0, np.zeros(1))))
    total(np.ones((2, 2), np.int64), 0, np.zeros(2))
    (file,) = kept_here.glob("*.machine_code")
    assert kept.read() is not None and file.stat().st_mode & 0o777 == 0o600
    if harm == "owner":
        if os.geteuid():
            pytest.skip("only root gives a file to another user")
        os.chown(file, NOBODY, NOBODY)
    elif harm == "mode":
        file.chmod(0o620)
    else:
        file.symlink_to(file.rename(kept_here / "elsewhere"))
    assert kept.read() is None


def test_code_is_written_in_the_place_of_a_link_not_where_it_leads(tmp_path: Path) -> None:
    victim, path = tmp_path / "victim", tmp_path / "kept"
    victim.write_text("mine")
    path.symlink_to(victim)
    write_own(path, b"code")
    assert victim.read_text() == "mine" and not path.is_symlink() and read_own(path) == b"code"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["kept", "victim"]


@pytest.mark.slow
@needs_root
def test_what_numba_kept_of_a_class_that_an_update_moved_is_compiled_anew(tmp_path: Path) -> None:
    import numba

    program = "import numpy as np\nfrom tests.test_compile import mean\nprint(mean(np.ones(3)))"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", program]
    assert subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout == "1.0\n"
    (index,) = tmp_path.rglob("*.nbi")
    of_before = pickle.dumps(numba.__version__) + b"cgroundstation.moved\nThing\n."
    index.write_bytes(of_before)
    done = subprocess.run(command, env=environment, check=False, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("1.0\n", "")
    assert index.read_bytes() != of_before, "kept again"


@pytest.mark.slow
def test_what_numba_pickled_is_not_loaded_from_the_folder_of_another_user(tmp_path: Path) -> None:
    program = "import numpy as np\nfrom tests.test_compile import mean\nprint(mean(np.ones(3)))"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}

    def run() -> str:
        done = subprocess.run(
            [sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True
        )
        return done.stdout

    assert run() == "1.0\n"
    indexes, mark = list(tmp_path.rglob("*.nbi")), tmp_path / "mark"
    assert indexes
    harm = f"cos\nsystem\n(S'touch {mark}'\ntR.".encode()  # a pickle that runs a command when it is loaded
    for file in indexes:
        file.write_bytes(harm)
        os.chown(file.parent, NOBODY, NOBODY)
    assert run() == "1.0\n" and not mark.exists()
    for file in indexes:
        os.chown(file.parent, 0, 0)
    subprocess.run([sys.executable, "-c", program], env=environment, check=False, capture_output=True)
    assert mark.exists(), "in a folder of our own it is loaded: the test shows something"
