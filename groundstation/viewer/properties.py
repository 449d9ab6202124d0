"""Results as properties of a recording, by which a catalog lists, sorts and filters."""

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import rerun as rr

from groundstation.base.version import __version__
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults
from groundstation.viewer.names import clean_text

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FLIGHT = "flight"  # name of the property that says what the recording is of
MOST_KEYS = 8  # of a mapping that is flattened: more are an array
Value = float | bool | str
_UNIT = re.compile(r"(_[a-z0-9]+)$")


def send_properties(stream: rr.RecordingStream, results: FlightResults) -> None:
    """Log the source of a recording and every figure of every answer.

    One property per answer, by its name.
    """
    for name, values in properties_of(results).items():
        stream.send_property(name, rr.AnyValues(True, **values))


def properties_of(results: FlightResults) -> dict[str, dict[str, Value]]:
    """Return properties by name: the flight, then every answer.

    An answer gives its numbers, flags and words; of an interval (``confidence95_deg``) both ends (``..._low_deg``,
    ``..._high_deg``), of what it holds in turn the same one level down. What is not known is left out.
    """
    flight: dict[str, Value] = {
        "aircraft": clean_text(results.metadata.get("aircraft", "")),
        "flight": clean_text(results.metadata.get("flight", "")),
        "source": clean_text(results.source.name),
        "status": results.status,
        "findings_fail": float(sum(finding.severity == "fail" for finding in results.findings)),
        "findings_warn": float(sum(finding.severity == "warn" for finding in results.findings)),
        "duration_s": float(results.duration_s),
        "version": __version__,
    }
    found = {FLIGHT: flight} | {name: _values(answer) for name, answer in results.answers.items()}
    return {name: values for name, values in found.items() if values}


def _values(answer: Answer) -> dict[str, Value]:
    found: dict[str, Value] = {}
    for field in fields(cast("DataclassInstance", answer)):  # every answer is one
        value = getattr(answer, field.name)
        if is_dataclass(value) and not isinstance(value, type):
            inner = ((f"{field.name}_{one.name}", getattr(value, one.name)) for one in fields(value))
            found |= {name: part for name, own in inner for name, part in _parts(name, own).items()}
        elif field.name == "settings":
            continue
        elif isinstance(value, Mapping) and len(value) <= MOST_KEYS:
            found |= {
                name: part
                for key, own in value.items()
                for name, part in _parts(_UNIT.sub(rf"_{key}\1", field.name), own).items()
            }
        else:
            found |= _parts(field.name, value)
    return found


def _parts(name: str, value: Any) -> Mapping[str, Value]:
    """Return a field of an answer as named values.

    Empty for a field that is no number, flag, word or pair of numbers.
    """
    if isinstance(value, bool):
        return {name: value}
    if isinstance(value, str):
        return {name: clean_text(value)} if value else {}
    if isinstance(value, int | float):
        return {name: float(value)} if np.isfinite(value) else {}
    is_pair = isinstance(value, tuple) and len(value) == 2
    if is_pair and all(isinstance(end, int | float) and np.isfinite(end) for end in value):
        ends = zip(("low", "high"), value, strict=True)
        return {_UNIT.sub(rf"_{which}\1", name): float(end) for which, end in ends}
    return {}
