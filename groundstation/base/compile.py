"""The one wrapper around numba: all compiled loops of the package are compiled here.

A loop is compiled at its first call, and numba imported then. Compiled code goes beside the source when that folder can
be written, else into the user's cache folder, else it is compiled again in each process; ``numba.njit(cache=True)``
alone raises at import in a read-only install without a home. It is loaded as code, and numba pickles what it keeps: a
folder that another user owns or may write is used by neither. Loops over numbers and arrays are kept as machine code of
their own (``base.machine_code``), and found again without numba; where another version of numba does not give that,
they are compiled like any others. Where nothing is kept, plain Python goes through the bytes of a small log: it has
done so before a compiler has started. Keep compiled functions scalar: small matrix products inside njit take 7-10 s to
compile.
"""

import os
import pickle
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dis import get_instructions
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from threading import RLock
from time import perf_counter
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np

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
SMALL_BYTES = 65_536  # plain Python takes up to a second for so many bytes of a log, and a compiler several
_BESIDE = Path(__file__).parent / "__pycache__"
PLAIN_S = 1.0  # longest time in plain Python for one loop of a process: then it is compiled, however few bytes come
_ANEW = "each process compiles its loops anew"
_UNREADABLE = ImportError, AttributeError, pickle.UnpicklingError  # raised by an unreadable pickle
_LOCK = RLock()  # numba and its linker are told one thing at a time


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o777 if folder == _BESIDE else 0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _serves(folder: Path) -> bool:
    """Tell whether compiled code may be kept in a folder: we can write to it, others cannot."""
    return _is_writable(folder) and not hand_of_others(folder)


@cache
def _cache_folder() -> Path | None:
    """Return the folder where compiled code is kept; None where there is none.

    numba is told of the folder when it is not the one beside the code.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if not chosen and _serves(_BESIDE):
        return _BESIDE
    folder = _own_choice()
    if folder is None or not _serves(folder):
        return None
    os.environ["NUMBA_CACHE_DIR"] = str(folder.resolve())  # a link on the way may be another one later
    return folder.resolve()


def _own_choice() -> Path | None:
    """Return the folder that ``NUMBA_CACHE_DIR`` names, else one in the user's cache.

    It is None for a user without a home.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "groundstation" / "numba"
    except RuntimeError:  # a user whom the machine does not know, as in many containers
        return None


def keeps_nothing() -> bool:
    """Tell whether no compiled code is kept yet.

    A log that needs compiled code then takes some seconds more; a flat CSV needs none.
    """
    folder = _cache_folder()
    return folder is None or not any(folder.glob(f"*{SUFFIX}"))


def why_nothing_is_kept() -> str:
    """Say why compiled code is kept nowhere, or by numba alone; empty where it is kept here."""
    if _cache_folder() is not None:
        return f"compiled code is not kept ({_refused[0]}): numba is loaded for what it keeps" if _refused else ""
    folder = _own_choice()
    if folder is None:
        reason = "no home folder"
    else:
        reason = f"{folder}: {(hand_of_others(folder) if folder.exists() else '') or 'it cannot be written'}"
    return f"compiled code is not kept ({reason}): {_ANEW}"


# Options of numba that it does not document: whatever goes wrong with them, a loop is compiled without.
_BARE = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_INSIDE_EACH = {"forceinline": True}
_refused: list[str] = []  # why loops of this process are compiled without them
_places: set[Path] = set()  # where numba keeps what it compiled of this process; each serves


def _compiled_by_numba(function: Callable[..., Any], **options: bool) -> Any:
    import numba

    with _LOCK:
        # its stubs do not know all of its options
        return cast(Callable[..., Any], numba.njit)(nogil=True, error_model="numpy", **options)(function)


def _forget_unreadable() -> None:
    """Remove numba's index files of this process that can no longer be read.

    They name a class that is no longer where it was.
    """
    for listed in (path for place in _places for path in place.glob("*.nbi")):
        with suppress(OSError):
            try:
                with listed.open("rb") as file:
                    pickle.load(file)  # numba's version
                    pickle.load(file)
            except (*_UNREADABLE, EOFError):
                listed.unlink(missing_ok=True)


class Loop:
    """Function that is compiled at its first call, from Python or from another compiled one.

    Parameters
    ----------
    function : callable
    is_kept : bool
        True where its machine code may be kept: it makes no array, and answers with a number or nothing.
    is_inlined : bool
        True where its code is put into each loop that calls it.
    small_bytes : int
        Length of its first argument up to which it is gone through in plain Python where no machine code is kept.
    """

    def __init__(
        self, function: Callable[..., Any], is_kept: bool = False, is_inlined: bool = False, small_bytes: int = 0
    ) -> None:
        self.py_func, self._is_inlined, self._small_bytes = function, is_inlined, small_bytes
        self._plain_s, self._is_missing = 0.0, dict[tuple[Form, ...], bool]()
        self._is_kept = is_kept and can_answer(function)
        self._linked: dict[tuple[Form, ...], Linked | None] = {}
        update_wrapper(self, function)

    @cached_property
    def _ordinary(self) -> Any:
        """Return the function as numba compiles it for calls from Python, kept in numba's cache.

        Only what numba documents is used.
        """
        function = self._calling(lambda loop: loop._ordinary)
        if _cache_folder() is not None:  # numba reads NUMBA_CACHE_DIR at its import
            kept = _compiled_by_numba(function, cache=True)
            place = getattr(getattr(kept, "stats", None), "cache_path", None)
            if place is not None and not hand_of_others(Path(place)):
                _places.add(Path(place))
                return kept
        return _compiled_by_numba(function)

    @cached_property
    def _part(self) -> Any:
        """Return the function as numba compiles it inside others; a call from Python crashes.

        It is kept with the code of those that call it. There is no code that takes its arguments from Python, which
        takes longer to compile than the function itself when those are tuples of arrays, and no counting of references
        to what it is handed.
        """
        options = _BARE | (_INSIDE_EACH if self._is_inlined else {})
        return _compiled_by_numba(self._calling(lambda loop: loop._part), **options)

    @cached_property
    def _plain(self) -> Any:
        """The function in plain Python, and those that it calls."""
        return self._calling(lambda loop: loop._plain)

    def _calling(self, instead: Callable[["Loop"], Any]) -> FunctionType:
        """Return the function with a replacement for each loop that it calls."""
        function, names = self.py_func, dict(self.py_func.__globals__)
        for step in get_instructions(function):  # its names alone are not enough: np.mean is none of a loop "mean"
            if step.opname == "LOAD_GLOBAL" and isinstance(called := names.get(step.argval), Loop):
                names[step.argval] = instead(called)
        return FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)

    def __call__(self, *arguments: Any) -> Any:
        """Run the loop by kept machine code where there is any, else by what numba compiles."""
        forms = forms_of(arguments) if self._is_kept else None
        if forms is None:
            return self._run_ordinary(arguments)
        if forms not in self._linked:
            if self._small_bytes and self._is_soon_done(forms, arguments):
                return self._run_plain(arguments)
            with _LOCK:
                if forms not in self._linked:
                    self._linked[forms] = self._found(forms)
        linked = self._linked[forms]
        if linked is None or linked.would_write(arguments):  # to arrays that are read-only: numba refuses them by name
            return self._run_ordinary(arguments)
        return linked(*arguments)

    def _run_ordinary(self, arguments: tuple[Any, ...]) -> Any:
        """Run what numba compiled; compile anew what it kept and can no longer read.

        numba pickles what it keeps, with the place of every class in it: an update that moves one makes it fail before
        the loop has begun.
        """
        try:
            return self._ordinary(*arguments)
        except _UNREADABLE:
            with _LOCK:
                _forget_unreadable()
                self.__dict__.pop("_ordinary", None)
            return self._ordinary(*arguments)

    def _is_soon_done(self, forms: tuple[Form, ...], arguments: tuple[Any, ...]) -> bool:
        """Tell whether plain Python will do: no machine code is kept and there is little to do."""
        if len(arguments[0]) > self._small_bytes or self._plain_s >= PLAIN_S:
            return False
        if forms not in self._is_missing:
            folder = _cache_folder()
            self._is_missing[forms] = folder is None or KeptCode(folder, self.py_func, forms).read() is None
        return self._is_missing[forms]

    def _run_plain(self, arguments: tuple[Any, ...]) -> Any:
        """Run the loop in plain Python, and measure the time."""
        begin = perf_counter()
        with np.errstate(all="ignore"):  # as compiled code does
            answer = self._plain(*arguments)
        self._plain_s += perf_counter() - begin
        annotation = self.py_func.__annotations__["return"]
        return None if annotation is None else annotation(answer)

    def __reduce__(self) -> str:
        """Pickle the loop as functions are pickled, by its name in its module."""
        return self.py_func.__qualname__

    def _found(self, forms: tuple[Form, ...]) -> Linked | None:
        """Return machine code for such arguments, kept before or compiled now; None if impossible."""
        folder = _cache_folder()
        kept = None if folder is None else KeptCode(folder, self.py_func, forms)
        try:
            code = kept.read() if kept else None
            is_new = code is None
            code = self._machine_code(forms) if code is None else code
            found = None if code is None else linked(code, self.py_func, forms)
        except Exception as error:  # an unknown numba or llvmlite: their documented way serves, but slower
            _refused.append(f"{self.py_func.__qualname__}: {' '.join(str(error).split())[:160]}")
            return None
        if kept and is_new and code is not None and found is not None:
            kept.write(code)
        return found

    def _machine_code(self, forms: tuple[Form, ...]) -> bytes | None:
        """Compile the loop for such arguments, with an entry that takes and gives plain C values."""
        import numba

        if getattr(numba.config, "DISABLE_JIT", False):
            return None
        names: dict[str, Any] = {"kernel": self._part, "array": cast(Any, numba).carray}
        source, kinds = entry_source(self.py_func, forms)
        exec(source, names | kinds, names)
        types: list[Any] = []
        for form in plain_forms(forms):
            if isinstance(form, str):
                types.append(numba.int64 if form == INTEGER else numba.float64)
            else:
                types += [numba.types.CPointer(numba.from_dtype(np.dtype(form[0]))), *[numba.int64] * form[1]]
        answer = numba.int64 if answers_with_integer(self.py_func) else numba.float64
        with _LOCK:
            entry = numba.cfunc(answer(*types), error_model="numpy")(names["entry"])
        return object_file(entry.inspect_llvm(), entry.native_name, forms)


def compiled(function: Function) -> Function:
    """Compile a scalar loop with numba at its first call.

    It may hold no Python objects; its errors are those of numpy.
    """
    return cast(Function, Loop(function))


def in_place(function: Function) -> Function:
    """Compile a loop that makes no array, like ``compiled``, and keep its machine code.

    References to the arrays it is handed are not counted: counting took up to 40 % of the time of loops that hand on
    tuples of arrays.
    """
    return cast(Function, Loop(function, is_kept=True))


def scanner(function: Function) -> Function:
    """Compile a loop over the bytes of a log, its first argument, like ``in_place``.

    Up to SMALL_BYTES are gone through in plain Python where no machine code is kept. No number in it may go beyond 64
    bits: there numpy and Python differ from compiled code.
    """
    return cast(Function, Loop(function, is_kept=True, small_bytes=SMALL_BYTES))


def inlined(function: Function) -> Function:
    """Compile a small part of other loops, like ``in_place``, into each loop that uses it.

    No call is made.
    """
    return cast(Function, Loop(function, is_kept=True, is_inlined=True))
