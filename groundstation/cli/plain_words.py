"""Words of the command line that need no conversion: texts, paths, listed words.

From 0.29 on Typer has pydantic convert every one of them, also those that are left out: a fifth of the time of
``convert`` on a short log. What is not plain, or wrong, still goes there.
"""

import os
import re
from functools import partial
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import typer.core
from typer.models import ParameterInfo

_DIGITS = re.compile("[0-9]{1,9}")  # a whole number that every parser reads alike


class _OtherError(Exception):
    """Error: the word is not plain."""


class PlainWords(typer.core.TyperCommand):
    """Verb whose plain words are taken as they stand."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, with that of the help."""
        return with_plain_words(self.callback, super().get_params(ctx))


class PlainGroup(typer.core.TyperGroup):
    """Group of verbs whose own options are taken as they stand."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, with that of the help."""
        return with_plain_words(self.callback, super().get_params(ctx))


def with_plain_words(callback: Any, parameters: list[Any]) -> list[Any]:
    """Return parameters of a verb, or of the application, that take plain words as they stand."""
    if others := [one for one in parameters if "process_value" not in vars(one)]:
        hints = get_type_hints(callback, include_extras=True) if callback else {}
        for one in others:
            kind, *about = get_args(hints.get(one.name)) or (None,)
            info = next((each for each in about if isinstance(each, ParameterInfo)), ParameterInfo())
            one.process_value = partial(_processed, one, one.process_value, kind, info)
    return parameters


def _processed(parameter: Any, original: Any, kind: Any, about: ParameterInfo, ctx: Any, value: Any) -> Any:
    is_list = bool(parameter.multiple or parameter.nargs == -1)
    if parameter.required and (value is None or (is_list and not value)):
        return original(ctx, value)
    try:
        taken = plain(value, kind, about, is_list=is_list)
    except _OtherError:
        return original(ctx, value)
    return taken if parameter.callback is None else parameter.callback(ctx, parameter, taken)


def plain(value: Any, kind: Any, about: ParameterInfo, *, is_list: bool = False) -> Any:
    """Return the value of a parameter's kind.

    Raises
    ------
    _OtherError
        When it is not plain.

    Examples
    --------
    >>> plain("b", Literal["a", "b"] | None, ParameterInfo()), plain((), list[str], ParameterInfo(), is_list=True)
    ('b', [])
    """
    if value is None:
        return () if is_list else None
    if get_origin(kind) in (Union, UnionType):
        kinds = [one for one in get_args(kind) if one is not NoneType]
        kind = kinds[0] if len(kinds) == 1 else None
    if get_origin(kind) is list and isinstance(value, list | tuple):
        return [plain(one, get_args(kind)[0], about) for one in value]
    if get_origin(kind) is Literal and value in get_args(kind):
        return value
    if kind in (str, bool, int, float) and type(value) is kind:
        return value
    if kind in (int, float) and isinstance(value, str) and _DIGITS.fullmatch(value):
        return _within(kind(value), about)
    if kind is Path and isinstance(value, str | Path) and not _is_checked(value, about):
        return Path(value)
    raise _OtherError


def _within(number: float, about: ParameterInfo) -> float:
    """Return a number that the limits of its parameter allow."""
    if (about.min is not None and number < about.min) or (about.max is not None and number > about.max):
        raise _OtherError
    return number


def _is_checked(path: str | Path, about: ParameterInfo) -> bool:
    """Tell whether Typer has to look at a path."""
    asks_more = about.exists or about.writable or about.resolve_path or about.allow_dash
    if asks_more or about.path_type or not (about.file_okay and about.dir_okay):
        return True
    return about.readable and Path(path).exists() and not os.access(path, os.R_OK)
