"""Dataclasses whose methods are made when they are first used.

The standard decorator compiles up to six methods from text for each class, some 0.4 ms; a verb imports hundreds of
classes and makes instances of a few. :func:`dataclass` means the same to a reader and to a type checker, and costs a
thirtieth: ``__init__`` is compiled at the first instance, and the other methods are shared code.
``fields``, ``replace``, ``asdict`` and ``field`` are those of the standard library.
"""

import dataclasses
import reprlib
from collections.abc import Callable
from operator import attrgetter
from typing import TYPE_CHECKING, Any

Method = Callable[..., Any]
INIT = "__init__"
_ABSENT = object()  # where a factory gives the value


class _Init:
    """Place of a class's ``__init__``: whoever asks for it first has it compiled."""

    def __init__(self, cls: type[Any], *, frozen: bool) -> None:
        self._cls, self._frozen = cls, frozen

    def __get__(self, instance: object, owner: type[Any]) -> Any:
        made = _compiled_init(self._cls, frozen=self._frozen)
        setattr(self._cls, INIT, made)  # at once: two threads that meet here compile the same twice
        return made.__get__(instance, owner)


def _compiled_init(cls: type[Any], *, frozen: bool) -> Any:
    """Return the ``__init__`` of a class: its fields in order, then those by name alone."""
    known = sorted(dataclasses.fields(cls), key=lambda one: bool(one.kw_only))
    names: dict[str, Any] = {"_dataclass_set": object.__setattr__, "_dataclass_absent": _ABSENT}
    parameters, body = ["self"], []
    optional = ""
    for one in known:
        if not one.init and one.default_factory is dataclasses.MISSING:
            continue  # a default is found on the class
        value, given = one.name, f"_dataclass_{one.name}"
        if one.default_factory is not dataclasses.MISSING:
            names[given] = one.default_factory
            value = f"{given}() if {one.name} is _dataclass_absent else {one.name}" if one.init else f"{given}()"
            default = "=_dataclass_absent"
        elif one.default is not dataclasses.MISSING:
            names[given] = one.default
            default = f"={given}"
        else:
            default = ""
        if one.init:
            if one.kw_only and "*" not in parameters:
                parameters.append("*")
            elif not one.kw_only and optional and not default:
                raise TypeError(f"non-default argument {one.name!r} follows default argument {optional!r}")
            optional = one.name if default else optional
            parameters.append(one.name + default)
        body.append(f"_dataclass_set(self, {one.name!r}, {value})" if frozen else f"self.{one.name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    text = f"def __init__({', '.join(parameters)}):\n " + "\n ".join(body or ["pass"])
    exec(text, names)
    made = names[INIT]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.{INIT}", cls.__module__
    made.__annotations__ = {one.name: one.type for one in known if one.init} | {"return": None}
    return made


def _values_of(cls: type[Any], wanted: Callable[[dataclasses.Field[Any]], object]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that gives an instance's values of the wanted fields of a class."""
    names = [one.name for one in dataclasses.fields(cls) if wanted(one)]
    if len(names) > 1:
        return attrgetter(*names)
    return lambda instance: tuple(getattr(instance, name) for name in names)


def _add_equality(cls: type[Any]) -> None:
    """Add ``__eq__``: equal values of instances of one class."""
    values: Callable[[Any], tuple[Any, ...]] | None = None

    def __eq__(self: object, other: object) -> bool:  # noqa: N807 (it becomes a method)
        nonlocal values
        if other.__class__ is not self.__class__:
            return NotImplemented
        if values is None:
            values = _values_of(cls, lambda one: one.compare)
        return values(self) == values(other)

    _add(cls, __eq__)


def _add_hash(cls: type[Any]) -> None:
    """Add ``__hash__``: that of the values compared."""
    values: Callable[[Any], tuple[Any, ...]] | None = None

    def __hash__(self: object) -> int:  # noqa: N807 (it becomes a method)
        nonlocal values
        if values is None:
            values = _values_of(cls, lambda one: one.compare if one.hash is None else one.hash)
        return hash(values(self))

    _add(cls, __hash__)


def _add_repr(cls: type[Any]) -> None:
    """Add ``__repr__``: the name of the class and its values by name."""

    @reprlib.recursive_repr()
    def __repr__(self: object) -> str:  # noqa: N807 (it becomes a method)
        shown = ", ".join(f"{one.name}={getattr(self, one.name)!r}" for one in dataclasses.fields(cls) if one.repr)
        return f"{self.__class__.__qualname__}({shown})"

    _add(cls, __repr__)


def _add_guards(cls: type[Any]) -> None:
    """Add the methods of a frozen class that refuse a change."""

    def __setattr__(self: object, name: str, value: object) -> None:  # noqa: N807 (it becomes a method)
        if type(self) is cls or name in cls.__dataclass_fields__:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: object, name: str) -> None:  # noqa: N807 (it becomes a method)
        if type(self) is cls or name in cls.__dataclass_fields__:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    for method in (__setattr__, __delattr__):
        if method.__name__ in vars(cls):
            raise TypeError(f"Cannot overwrite attribute {method.__name__} in class {cls.__name__}")
        _add(cls, method)


def _add(cls: type[Any], method: Method) -> None:
    """Add a method unless the class has its own."""
    if method.__name__ not in vars(cls):
        method.__qualname__ = f"{cls.__qualname__}.{method.__name__}"
        setattr(cls, method.__name__, method)


def _lazily(cls: type[Any], *, frozen: bool, eq: bool, repr: bool, kw_only: bool) -> type[Any]:
    """Make a class a dataclass."""
    if cls.__doc__ is None:
        cls.__doc__ = cls.__name__  # the standard decorator would look at the signature, which compiles
    explicit_hash = vars(cls).get("__hash__", dataclasses.MISSING)
    has_hash = explicit_hash is not dataclasses.MISSING and not (explicit_hash is None and "__eq__" in vars(cls))
    is_heir = any(dataclasses.is_dataclass(base) for base in cls.__mro__[1:])
    # Only the standard decorator refuses a frozen heir of a class that is not, and the other way round.
    dataclasses.dataclass(init=False, repr=False, eq=False, frozen=frozen and is_heir, kw_only=kw_only)(cls)
    cls.__dataclass_params__.frozen = frozen
    if INIT not in vars(cls):
        setattr(cls, INIT, _Init(cls, frozen=frozen))
    if repr:
        _add_repr(cls)
    if eq:
        _add_equality(cls)
        if not has_hash and frozen:
            _add_hash(cls)
        elif not has_hash:
            cls.__hash__ = None  # type: ignore[assignment]
    if frozen and not is_heir:
        _add_guards(cls)
    return cls


def _dataclass(
    cls: type[Any] | None = None,
    /,
    *,
    frozen: bool = False,
    eq: bool = True,
    repr: bool = True,
    kw_only: bool = False,
    **others: Any,
) -> Any:
    """Make a class a dataclass; with other options the standard decorator does it."""
    options = {"frozen": frozen, "eq": eq, "repr": repr, "kw_only": kw_only}
    if others:
        return dataclasses.dataclass(cls, **options, **others)

    def decorate(given: type[Any]) -> type[Any]:
        return _lazily(given, **options)

    return decorate if cls is None else decorate(cls)


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    dataclass = _dataclass
