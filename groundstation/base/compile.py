"""The one wrapper around numba: loops that must be loops are compiled here and nowhere else.

The cache goes beside the code when that folder can be written, else into the user's cache folder, else there is none;
``numba.njit(cache=True)`` alone raises at import in a read-only install without a home.
Keep compiled functions scalar: small matrix products inside njit take 7-10 s to compile.
"""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _choose_cache() -> bool:
    if os.environ.get("NUMBA_CACHE_DIR"):
        return _is_writable(Path(os.environ["NUMBA_CACHE_DIR"]))
    if _is_writable(Path(__file__).parent / "__pycache__"):
        return True
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "groundstation" / "numba"
    if _is_writable(user_cache):
        os.environ["NUMBA_CACHE_DIR"] = str(user_cache)
        return True
    return False


def compiled(function: Function) -> Function:
    """Compile a scalar-loop function with numba at its first call (no Python objects, errors as in numpy).

    Modules that use it are imported lazily: importing numba takes about half a second.
    """
    return _compile(function)


def in_place(function: Function) -> Function:
    """The same for a loop that makes no array: without the counting of references to those that it is handed, which
    took up to 40 % of the time of loops that hand on tuples of them."""
    return _compile(function, _nrt=False)


def part(function: Function) -> Function:
    """Like ``in_place``, for what only other compiled loops call: without the code that takes its arguments from
    Python, which takes longer to compile than the function itself when those are tuples of arrays. From Python a call
    crashes."""
    return _compile(function, _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def inlined(function: Function) -> Function:
    """Like ``in_place``, for a small part of other compiled loops: its code is put into each and no call is made."""
    return _compile(function, _nrt=False, forceinline=True)


def _compile(function: Function, **options: bool) -> Function:
    cache = _choose_cache()  # before numba is imported: it reads NUMBA_CACHE_DIR once
    import numba

    decorate: Callable[..., Any] = numba.njit  # its stubs do not know all of its options
    return cast(Function, decorate(cache=cache, nogil=True, error_model="numpy", **options)(function))
