"""Compiled loops kept as machine code, so that a process loads one without the compiler.

numba itself takes half a second to start and as long again for its first function, though both were compiled before.
Here an object file of this processor is kept with the name of its entry. The entry takes plain C values: a pointer and
a shape for each array. llvmlite, which numba brings, links it in some milliseconds.
"""

import ctypes
import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache, cached_property
from itertools import count
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.installed import installed_version
from groundstation.base.own_files import read_own, write_own

INTEGER, NUMBER = "integer", "number"
_DTYPES = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64", "bool"]
ARRAY_DTYPES = {np.dtype(name): name for name in _DTYPES}  # in the byte order of this machine
ENTRY, SUFFIX = "groundstation_entry", ".machine_code"
LAYOUT = 4  # version of the layout of kept files
_RESULTS: dict[Any, type] = {int: ctypes.c_int64, bool: ctypes.c_int64, float: ctypes.c_double, None: ctypes.c_int64}
MOST_COPIED_BYTES = 1 << 25  # limit of copying read-only arrays that a call may write to
_NO_BYTES = ctypes.c_char * 0
_NUMBERS = count()  # every library has a name of its own
_NOT_WRITTEN = {b"readonly", b"readnone"}  # LLVM's marks on an array that is only read, or not touched
_HARMLESS = frozenset(("memset", "memcpy", "memmove", "memcmp", "sqrt", "sin", "cos", "exp", "log", "pow", "atan2"))


@dataclass(frozen=True)
class Group:
    """Form of a tuple: its class, the names of its parts where it has any, and their forms."""

    kind: type
    names: tuple[str, ...]
    parts: "tuple[Form, ...]"


Form = str | tuple[str, int] | Group  # form of an argument: INTEGER, NUMBER, dtype and dimensions of an array, a tuple


def forms_of(arguments: Sequence[Any]) -> tuple[Form, ...] | None:
    """Return the forms of the arguments of a loop; None for arguments that are not supported.

    Supported are numbers of 64 bits, arrays without gaps in the byte order of this machine, and tuples of those.

    Examples
    --------
    >>> forms_of((np.zeros(3, np.uint8), True, 2.5))
    (('uint8', 1), 'integer', 'number')
    """
    forms: list[Form] = []
    for one in arguments:
        if isinstance(one, np.ndarray):
            name, flags = ARRAY_DTYPES.get(one.dtype), one.flags
            if name is None or not one.ndim or not flags.c_contiguous or not flags.aligned:
                return None
            forms.append((name, one.ndim))
        elif isinstance(one, int | np.integer):
            if not -(2**63) <= one < 2**63:
                return None
            forms.append(INTEGER)
        elif isinstance(one, float | np.floating):
            forms.append(NUMBER)
        elif isinstance(one, tuple):
            parts = forms_of(one)
            if parts is None:
                return None
            forms.append(Group(type(one), getattr(one, "_fields", ()), parts))
        else:
            return None
    return tuple(forms)


def can_answer(function: Callable[..., Any]) -> bool:
    """Tell whether a loop answers with a number or nothing, by its annotation."""
    return _annotation(function) in _RESULTS


def answers_with_integer(function: Callable[..., Any]) -> bool:
    """Tell whether the entry of :func:`entry_source` returns an integer, else a float64."""
    return _RESULTS[_annotation(function)] is ctypes.c_int64


def _annotation(function: Callable[..., Any]) -> Any:
    return function.__annotations__.get("return", ...)


def entry_source(function: Callable[..., Any], forms: Sequence[Form]) -> tuple[str, dict[str, type]]:
    """Return the source of the entry of a loop, and the tuples that it names.

    It is compiled beside ``kernel`` and ``array``.

    Examples
    --------
    >>> def total(table, first) -> int: ...
    >>> print(entry_source(total, (("int64", 2), "integer"))[0])
    def entry(a0, a0_0, a0_1, a1):
        return kernel(array(a0, (a0_0, a0_1,)), a1)
    """
    taken, kinds = list[str](), dict[str, type]()

    def handed(form: Form, name: str) -> str:
        if isinstance(form, Group):
            parts = ", ".join(handed(part, f"{name}_{at}") for at, part in enumerate(form.parts))
            if not form.names:
                return f"({parts},)" if parts else "()"
            kinds[f"Of_{name}"] = form.kind
            return f"Of_{name}({parts})"
        lengths = [] if isinstance(form, str) else [f"{name}_{axis}" for axis in range(form[1])]
        taken.extend((name, *lengths))
        return f"array({name}, ({', '.join(lengths)},))" if lengths else name

    call = f"kernel({', '.join(handed(form, f'a{at}') for at, form in enumerate(forms))})"
    answer = f"{call}\n    return 0" if _annotation(function) is None else f"return {call}"
    return f"def entry({', '.join(taken)}):\n    {answer}", kinds


def plain_forms(forms: Sequence[Form]) -> Iterator[str | tuple[str, int]]:
    """Return the forms of numbers and arrays, with those in tuples in their place."""
    for form in forms:
        if isinstance(form, Group):
            yield from plain_forms(form.parts)
        else:
            yield form


def digest_of(function: Callable[..., Any], forms: Sequence[Form]) -> bytes:
    """Return a digest of all that the machine code of a loop depends on.

    That is its code and constants, and those of all that it calls.
    """
    from llvmlite import __version__, binding

    told = hashlib.sha256(
        repr((LAYOUT, forms, entry_source(function, forms)[0], installed_version("numba"), __version__)).encode()
    )
    told.update(f"{binding.get_host_cpu_name()} {binding.get_host_cpu_features().flatten()}".encode())
    told.update(binding.get_process_triple().encode())
    seen: set[int] = set()

    def tell(one: Any) -> None:
        code = one.__code__
        constants = [constant for constant in code.co_consts if not hasattr(constant, "co_code")]
        told.update(repr((one.__qualname__, code.co_code, constants, code.co_names, code.co_varnames)).encode())
        for name in code.co_names:
            value = one.__globals__.get(name)
            called = getattr(value, "py_func", None)
            if isinstance(called, FunctionType):
                if id(called) not in seen:
                    seen.add(id(called))
                    tell(called)
            elif isinstance(value, bool | int | float | str | tuple):
                told.update(repr((name, value)).encode())
            elif isinstance(value, type):
                told.update(repr((name, getattr(value, "_fields", ()))).encode())

    tell(function)
    return told.digest()


class KeptCode:
    """Machine code of one loop for arguments of one form, in a file beside the others."""

    def __init__(self, folder: Path, function: Callable[..., Any], forms: Sequence[Form]) -> None:
        short = hashlib.sha256(repr(forms).encode()).hexdigest()[:8]
        self._path = folder / f"{function.__module__}.{function.__qualname__}-{short}{SUFFIX}"
        self._of = function, forms

    def read(self) -> bytes | None:
        """Read the object file; None where there is no usable one.

        A file of other code, of another processor, or one that others may write is not usable.
        """
        content = read_own(self._path)
        if content is None:
            return None
        head, code = content[: len(self._head(b""))], content[len(self._head(b"")) :]
        return code if head == self._head(code) else None

    def write(self, code: bytes) -> None:
        """Keep an object file, unless the folder cannot be written."""
        with suppress(OSError):
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_own(self._path, self._head(code) + code)

    @cached_property
    def _digest(self) -> bytes:
        return digest_of(*self._of)

    def _head(self, code: bytes) -> bytes:
        return self._digest + hashlib.sha256(code).digest()


@cache
def _linker() -> Any:
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding.create_lljit_compiler()


def object_file(text: str, entry: str, forms: Sequence[Form]) -> bytes | None:
    """Return the bytes to keep of an LLVM module.

    They are None where its entry may call a function that only numba's process has. The bytes are one for each number
    and array that the entry takes, 1 for an array that it may write to, and then an object file.
    """
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    module = binding.parse_assembly(text)
    for one in (*module.functions, *module.global_variables):
        if not one.is_declaration and one.name != entry:
            one.linkage = "internal"
    module.get_function(entry).name = ENTRY
    machine = binding.Target.from_default_triple().create_target_machine(
        cpu=binding.get_host_cpu_name(), features=binding.get_host_cpu_features().flatten(), opt=3, reloc="pic"
    )
    tuning = binding.create_pipeline_tuning_options(speed_level=3)
    tuning.loop_vectorization = tuning.slp_vectorization = True
    passes = binding.create_pass_builder(machine, tuning)
    passes.getModulePassManager().run(module, passes)
    if _calls_out(module):
        return None
    code: bytes = machine.emit_object(module)
    return _written(module, forms) + code


def _written(module: Any, forms: Sequence[Form]) -> bytes:
    """Return a byte for each plain form: 1 for an array that the code may write to.

    That is one which LLVM cannot prove to be left unchanged. The order is that of :func:`plain_forms`.
    """
    arguments = list(module.get_function(ENTRY).arguments)
    may_write = []
    for form in plain_forms(forms):
        dimensions = 0 if isinstance(form, str) else form[1]
        may_write.append(dimensions > 0 and _NOT_WRITTEN.isdisjoint(arguments[0].attributes))
        arguments = arguments[1 + dimensions :]
    return bytes(may_write)


def _calls_out(module: Any) -> bool:
    """Tell whether a module needs a function that is neither of LLVM nor of C.

    The module holds only what its entry needs.
    """
    outside = {one.name for one in module.functions if one.is_declaration and not one.name.startswith("llvm.")}
    return bool(outside - _HARMLESS)


def linked(kept: bytes, function: Callable[..., Any], forms: Sequence[Form]) -> "Linked | None":
    """Link machine code of :func:`object_file` so that it can be called; None if that fails."""
    from llvmlite import binding

    plain = tuple(plain_forms(forms))
    code = kept[len(plain) :]
    library = binding.JITLibraryBuilder().add_object_img(code).export_symbol(ENTRY).add_current_process()
    written = tuple(at for at, may_write in enumerate(kept[: len(plain)]) if may_write)
    try:
        return Linked(library.link(_linker(), f"{ENTRY}_{next(_NUMBERS)}"), function, plain, written)
    except RuntimeError:
        return None


class Linked:
    """Machine code that can be called with what the loop takes.

    Parameters
    ----------
    library : object
        Holds the code.
    function : callable
        The loop in Python.
    plain : sequence of forms
        Forms of its arguments, with those in tuples in their place.
    written : sequence of int
        Numbers of the arrays that it may write to.
    """

    def __init__(
        self, library: Any, function: Callable[..., Any], plain: Sequence[str | tuple[str, int]], written: Sequence[int]
    ) -> None:
        self._library = library  # the code lives as long as this
        self._written = written
        kinds: list[Any] = []
        for form in plain:
            if isinstance(form, str):
                kinds.append(ctypes.c_int64 if form == INTEGER else ctypes.c_double)
            else:
                kinds += [ctypes.c_void_p, *[ctypes.c_int64] * form[1]]
        self._entry = ctypes.CFUNCTYPE(_RESULTS[_annotation(function)], *kinds)(self._library[ENTRY])
        self._annotation = _annotation(function)

    def would_write(self, arguments: Sequence[Any]) -> bool:
        """Tell whether a call may write to read-only arrays that are too large to copy for it."""
        plain = _plain(arguments)
        return bool(sum(plain[at].nbytes for at in self._written if not plain[at].flags.writeable) > MOST_COPIED_BYTES)

    def __call__(self, *arguments: Any) -> Any:
        """Run the loop.

        LLVM cannot prove of every array that it is left as it is: of those that are read-only the loop gets copies.

        Raises
        ------
        ValueError
            When it has written to one of them.
        """
        plain = _plain(arguments)
        copied = [at for at in self._written if not plain[at].flags.writeable]
        handed = {at: plain[at].copy() for at in copied}
        values: list[Any] = []
        for at, one in enumerate(plain):
            if isinstance(one, np.ndarray):
                values += (_address(handed.get(at, one)), *one.shape)
            else:
                values.append(one)
        answer = self._entry(*values)
        if not all(np.array_equal(handed[at].view(np.uint8), plain[at].view(np.uint8)) for at in copied):
            raise ValueError("a compiled loop would write to an array that is readonly")
        return None if self._annotation is None else self._annotation(answer)


def _address(array: Any) -> int:
    """Return the address of an array's first value.

    ``array.ctypes.data`` takes two to three times as long.
    """
    if array.flags.writeable:
        return ctypes.addressof(_NO_BYTES.from_buffer(array))
    address: int = array.__array_interface__["data"][0]
    return address


def _plain(arguments: Sequence[Any]) -> list[Any]:
    """Return the arguments, with those in tuples in their place."""
    plain: list[Any] = []
    for one in arguments:
        if isinstance(one, tuple):
            plain += _plain(one)
        else:
            plain.append(one)
    return plain
