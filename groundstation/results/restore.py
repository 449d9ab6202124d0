"""Saved answers as dataclasses again: what summary.json tells, rounded as it was written."""

import types
import typing
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any

from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.results.flight import FlightResults
from groundstation.results.forecast import ForecastResult
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.latency import Latencies
from groundstation.results.magnetic import MagneticResult
from groundstation.results.magnetic_ground import GroundDeviation

# The answer that each analysis saves, by the name of the analysis in ``results`` of summary.json.
ANSWER_TYPES: Mapping[str, type] = MappingProxyType(
    {
        "heading": HeadingResult,
        "inertial": InertialResult,
        "forecast": ForecastResult,
        "latency": Latencies,
        "magnetic": MagneticResult,
        "magnetic_ground": GroundDeviation,
    }
)


def restored(summary: Mapping[str, Any], where: str, answer_types: Mapping[str, type] = ANSWER_TYPES) -> FlightResults:
    """Results of a flight as the run had them, but for the digits that summary.json leaves out.

    Parameters
    ----------
    summary : mapping
        The content of summary.json.
    where : str
        What the summary came from, for errors.
    answer_types : mapping of analysis name to dataclass
        Answers of other analyses are left out.

    Returns
    -------
    FlightResults
        Without arrays: they are in files of their own.

    Raises
    ------
    UnreadableLogError
        When the summary lacks what a result needs.
    """
    try:
        flight = summary["flight"]
        start = flight["start_utc"]
        general = {
            **summary,
            "flight_id": flight["id"],
            "source": flight["source"],
            "metadata": flight["metadata"],
            "start_utc_ns": None if start is None else iso_to_utc_ns(start)[0],
            "duration_s": flight["duration_s"],
        }
        result: FlightResults = _value(FlightResults, general)
        return replace(result, **_answers(summary["results"], answer_types))
    except (KeyError, TypeError, ValueError, AttributeError, GroundstationError) as error:
        what = f"a summary that cannot be used ({type(error).__name__}: {error})"
        raise UnreadableLogError(where, what, "one that this version writes", "run the log again") from error


def _answers(documents: Mapping[str, Any], answer_types: Mapping[str, type]) -> dict[str, Any]:
    """The answers among ``results`` of a summary, by the name of their analysis."""
    found = {}
    for name, answer in documents.items():
        if name in answer_types:
            found[name] = _value(answer_types[name], _with_channels(answer) if name == "inertial" else answer)
    return found


def restored_magnetic(summary: Mapping[str, Any]) -> MagneticResult:
    """The magnetic deviation in a summary alone, whatever the rest of it is, without figures.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError
        When there is none, or it is not as this version writes it.
    """
    result: MagneticResult = _value(MagneticResult, summary["results"]["magnetic"])
    return result


def _with_channels(inertial: Mapping[str, Any]) -> dict[str, Any]:
    """INS errors with the channels as a list: in the summary each stands under its own name."""
    return {**inertial, "channels": [inertial[name] for name in ("north", "east") if name in inertial]}


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
    if is_dataclass(hint):
        if not isinstance(value, Mapping):
            raise TypeError(f"{value!r} is no object")
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
