"""Saved answers as dataclasses again: what summary.json tells, rounded as it was written."""

import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from typing import Any

from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.results.answer import Answer
from groundstation.results.files import SUMMARY, SavedFlight
from groundstation.results.flight import FlightResults
from groundstation.results.forecast import ForecastResult
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.latency import Latencies
from groundstation.results.magnetic import MagneticResult
from groundstation.results.magnetic_ground import GroundDeviation

KINDS: tuple[type[Answer], ...] = (
    *(HeadingResult, InertialResult, ForecastResult, Latencies, MagneticResult, GroundDeviation),
)


def restored(saved: SavedFlight, kinds: Iterable[type[Answer]] = KINDS) -> FlightResults:
    """Results of a flight folder as the run had them, but for the digits that summary.json leaves out.

    Parameters
    ----------
    saved : SavedFlight
    kinds : iterable of types
        Those of the answers; one that the summary has besides is left out.

    Returns
    -------
    FlightResults
        Every array stands in its ``figures``; those of the analyses are empty.

    Raises
    ------
    UnreadableLogError
        When the summary lacks what a result needs.
    """
    try:
        summary = saved.summary
        flight, start = summary["flight"], summary["flight"]["start_utc"]
        document = {
            **{key: value for key, value in summary.items() if key != "results"},
            "flight_id": flight["id"],
            "source": flight["source"],
            "metadata": flight["metadata"],
            "start_utc_ns": None if start is None else iso_to_utc_ns(start)[0],
            "duration_s": flight["duration_s"],
            "figures": tuple(saved.figures.values()),
        }
        told = summary["results"]
        answers = {kind.analysis: _value(kind, told[kind.analysis]) for kind in kinds if kind.analysis in told}
        result: FlightResults = replace(_value(FlightResults, document), answers=answers)
    except (KeyError, TypeError, ValueError, AttributeError, GroundstationError) as error:
        what = f"a summary that cannot be used ({type(error).__name__}: {error})"
        raise UnreadableLogError(
            str(saved.folder / SUMMARY), what, "one that this version writes", "run the log again"
        ) from error
    return result


def restored_magnetic(summary: Mapping[str, Any]) -> MagneticResult:
    """The magnetic deviation in a summary alone, whatever the rest of it is, without figures.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError
        When there is none, or it is not as this version writes it.
    """
    result: MagneticResult = _value(MagneticResult, summary["results"]["magnetic"])
    return result


def _value(hint: Any, value: Any) -> Any:
    """A JSON value as a type says; null where a number is meant is NaN."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in arguments:
            return None
        kind = tuple if isinstance(value, list) else None
        members = [member for member in arguments if member is not type(None)]
        return _value(next((one for one in members if typing.get_origin(one) is kind), members[0]), value)
    if hint is float:
        return float("nan") if value is None else float(value)
    if origin is typing.Literal:
        if value not in arguments:
            raise ValueError(f"{value!r} is none of {arguments}")
        return value
    if origin is Mapping and not isinstance(value, Mapping):
        raise TypeError(f"{value!r} is no mapping")
    if hint in (int, str, bool):
        if not isinstance(value, hint):
            raise TypeError(f"{value!r} is no {hint.__name__}")
        return value
    if origin is tuple:
        item = arguments if arguments[-1] is not Ellipsis else arguments[:1] * len(value)
        return tuple(_value(one, part) for one, part in zip(item, value, strict=True))
    if is_dataclass(hint) and isinstance(value, Mapping):
        return _instance(typing.cast(type, hint), value)
    return value


def _instance(cls: type, document: Mapping[str, Any]) -> Any:
    hints = typing.get_type_hints(cls)
    values = {}
    for part in fields(cls):
        if part.name in document:
            values[part.name] = _value(hints[part.name], document[part.name])
        elif part.default is MISSING and part.default_factory is MISSING:
            raise KeyError(part.name)
    return cls(**values)
