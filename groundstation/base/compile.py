"""The one wrapper around numba: loops that must be loops are compiled here and nowhere else.

A loop is compiled at its first call, and numba imported then. What was compiled goes beside the code when that folder
can be written, else into the user's cache folder, else it is compiled again in each process; ``numba.njit(cache=True)``
alone raises at import in a read-only install without a home. It is loaded as code: a folder that another user owns or
may write serves neither here nor for numba, which pickles what it keeps. Loops over numbers and arrays are kept as
machine code of their own (``base.machine_code``), and found again without numba. Where nothing is kept, plain Python
goes through the bytes of a small log: it has done so before a compiler has started.
Keep compiled functions scalar: small matrix products inside njit take 7-10 s to compile.
"""

import os
import tempfile
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from threading import RLock
from time import perf_counter
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np

from groundstation.base.drafts import drafts
from groundstation.base.machine_code import (
    INTEGER,
    SUFFIX,
    Form,
    KeptCode,
    Linked,
    answers_with_integer,
    can_answer,
    entry_source,
    forms_of,
    linked,
    object_file,
    plain_forms,
)
from groundstation.base.own_files import hand_of_others

Function = TypeVar("Function", bound=Callable[..., Any])
SMALL_BYTES = 65_536  # of a log: plain Python takes up to a second for so many, and a compiler several
_BESIDE = Path(__file__).parent / "__pycache__"
PLAIN_S = 1.0  # of a process for one loop: after that it is compiled, however few bytes come
_LOCK = RLock()  # numba and its linker are told one thing at a time


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o777 if folder == _BESIDE else 0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _serves(folder: Path) -> bool:
    """Whether compiled code may be kept in a folder: it can be written, and not by others."""
    return _is_writable(folder) and not hand_of_others(folder)


@cache
def _cache_folder() -> Path | None:
    """Where compiled code is kept; numba is told of it where it is not beside the code."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if not chosen and _serves(_BESIDE):
        return _BESIDE
    folder = _own_choice()
    if folder is None or not _serves(folder):
        return None
    os.environ["NUMBA_CACHE_DIR"] = str(folder.resolve())  # a link on the way may be another one later
    return folder.resolve()


def _own_choice() -> Path | None:
    """The folder that ``NUMBA_CACHE_DIR`` names, else one in the user's cache; None for a user without a home."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "groundstation" / "numba"
    except RuntimeError:  # a user whom the machine does not know, as in many containers
        return None


def keeps_nothing() -> bool:
    """Whether nothing compiled is kept: what a log needs of it (a flat CSV needs nothing) takes some seconds more."""
    folder = _cache_folder()
    return folder is None or not any(folder.glob(f"*{SUFFIX}"))


def why_nothing_is_kept() -> str:
    """Say why compiled code is kept nowhere; empty where it is."""
    if _cache_folder() is not None:
        return ""
    folder = _own_choice()
    if folder is None:
        reason = "no home folder"
    else:
        reason = f"{folder}: {(hand_of_others(folder) if folder.exists() else '') or 'it cannot be written'}"
    return f"compiled code is not kept ({reason}): each process compiles its loops anew"


def _njit(numba: Any) -> Callable[..., Any]:
    """Its stubs do not know all of its options."""
    return cast(Callable[..., Any], numba.njit)


class Loop:
    """A function that is compiled when it is first called, by Python or by another one that is compiled."""

    def __init__(self, function: Callable[..., Any], options: dict[str, bool], small_bytes: int = 0) -> None:
        self.py_func, self._options, self._small_bytes = function, options, small_bytes
        self._plain_s, self._is_missing = 0.0, dict[tuple[Form, ...], bool]()
        self._is_kept = options.get("_nrt", True) is False and can_answer(function)
        self._linked: dict[tuple[Form, ...], Linked | None] = {}
        update_wrapper(self, function)

    @cached_property
    def _called(self) -> Any:
        """The function as numba has it for calls from Python, kept in its cache."""
        if _cache_folder() is not None:  # numba reads NUMBA_CACHE_DIR at its import
            kept = self._dispatcher(is_cached=True)
            if not hand_of_others(Path(kept.stats.cache_path)):
                return kept
        return self._dispatcher(is_cached=False)

    @cached_property
    def _part(self) -> Any:
        """The function as numba has it inside others, with whose code it is kept; from Python a call crashes."""
        return self._dispatcher(is_cached=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)

    def _dispatcher(self, is_cached: bool, **options: bool) -> Any:
        import numba

        with _LOCK:
            options = self._options | options
            return _njit(numba)(cache=is_cached, nogil=True, error_model="numpy", **options)(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """What numba takes it for where another compiled function calls it."""
        return self._part._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """Run it: kept machine code where there is any, else what numba compiles."""
        forms = forms_of(arguments) if self._is_kept else None
        if forms is None:
            return self._called(*arguments)
        if forms not in self._linked:
            if self._small_bytes and self._is_soon_done(forms, arguments):
                return self._run_plain(arguments)
            with _LOCK:
                if forms not in self._linked:
                    self._linked[forms] = self._found(forms)
        linked = self._linked[forms]
        if linked is None or linked.would_write(arguments):  # to an array that is read-only: numba refuses it by name
            return self._called(*arguments)
        return linked(*arguments)

    def _is_soon_done(self, forms: tuple[Form, ...], arguments: tuple[Any, ...]) -> bool:
        """Whether there is nothing kept, and so little to do that it need not be compiled."""
        if len(arguments[0]) > self._small_bytes or self._plain_s >= PLAIN_S:
            return False
        if forms not in self._is_missing:
            folder = _cache_folder()
            self._is_missing[forms] = folder is None or KeptCode(folder, self.py_func, forms).read() is None
        return self._is_missing[forms]

    @cached_property
    def _plain(self) -> Any:
        return _in_plain_python(self.py_func, {})

    def _run_plain(self, arguments: tuple[Any, ...]) -> Any:
        """The same by Python, and the time that it took."""
        begin = perf_counter()
        with np.errstate(all="ignore"):  # as compiled code does
            answer = self._plain(*arguments)
        self._plain_s += perf_counter() - begin
        annotation = self.py_func.__annotations__["return"]
        return None if annotation is None else annotation(answer)

    def __reduce__(self) -> str:
        """A loop is pickled as functions are, by its name in its module."""
        return self.py_func.__qualname__

    def _found(self, forms: tuple[Form, ...]) -> Linked | None:
        """Machine code for such arguments, kept before or compiled now; None where there cannot be any."""
        folder = _cache_folder()
        if folder is None:
            return None
        kept = KeptCode(folder, self.py_func, forms)
        code = kept.read()
        if code is None:
            code = self._machine_code(forms)
            if code is None:
                return None
            kept.write(code)
        return linked(code, self.py_func, forms)

    def _machine_code(self, forms: tuple[Form, ...]) -> bytes | None:
        """Compile the loop for such arguments, with an entry that takes plain C values."""
        import numba
        from numba.core import config
        from numba.np.arrayobj import get_cfarray_intrinsic

        if getattr(config, "DISABLE_JIT", False):
            return None
        names: dict[str, Any] = {"kernel": self._part, "array": get_cfarray_intrinsic("C", None)}
        source, kinds = entry_source(self.py_func, forms)
        exec(source, names | kinds, names)
        types: list[Any] = [numba.types.CPointer(numba.int64 if answers_with_integer(self.py_func) else numba.float64)]
        for form in plain_forms(forms):
            if isinstance(form, str):
                types.append(numba.int64 if form == INTEGER else numba.float64)
            else:
                types += [numba.types.CPointer(numba.from_dtype(np.dtype(form[0]))), *[numba.int64] * form[1]]
        options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False}
        with drafts():
            entry = _njit(numba)(tuple(types), nogil=True, error_model="numpy", **options)(names["entry"])
        (compiled,) = entry.overloads.values()
        name = compiled.fndesc.llvm_func_name
        return object_file(compiled.library.optimised(name), name, forms)


def _in_plain_python(function: Any, made: dict[Any, Any]) -> Any:
    """A function with plain ones in the place of the loops that it calls."""
    if function not in made:
        names = dict(function.__globals__)
        made[function] = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
        for name in function.__code__.co_names:
            if isinstance(names.get(name), Loop):
                names[name] = _in_plain_python(names[name].py_func, made)
    return made[function]


def compiled(function: Function) -> Function:
    """Compile a scalar-loop function with numba at its first call (no Python objects, errors as in numpy)."""
    return _compile(function)


def in_place(function: Function) -> Function:
    """The same for a loop that makes no array: without the counting of references to those that it is handed, which
    took up to 40 % of the time of loops that hand on tuples of them."""
    return _compile(function, _nrt=False)


def scanner(function: Function) -> Function:
    """Like ``in_place``, for a loop over the bytes of a log, its first argument: up to SMALL_BYTES of them are gone
    through in plain Python where no machine code is kept. No number in it may go beyond 64 bits: numpy's and Python's
    differ there from compiled ones."""
    return _compile(function, SMALL_BYTES, _nrt=False)


def part(function: Function) -> Function:
    """Like ``in_place``, for what only other compiled loops call: without the code that takes its arguments from
    Python, which takes longer to compile than the function itself when those are tuples of arrays. From Python a call
    crashes."""
    return _compile(function, _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def inlined(function: Function) -> Function:
    """Like ``in_place``, for a small part of other compiled loops: its code is put into each and no call is made."""
    return _compile(function, _nrt=False, forceinline=True)


def _compile(function: Function, small_bytes: int = 0, **options: bool) -> Function:
    return cast(Function, Loop(function, options, small_bytes))
