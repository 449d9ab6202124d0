"""Roles that map messages of a log to canonical fields, each with its rules, best first.

All readers whose logs name their messages share it: a reader states its roles and what its log offers.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from types import MappingProxyType
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.atmosphere import pressure_altitude_m
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Remark

Columns: TypeAlias = dict[str, Column]


class NumericColumns(Protocol):
    """Columns of messages by name, as floating-point numbers."""

    def __contains__(self, name: str, /) -> bool: ...

    def __getitem__(self, name: str, /) -> FloatArray: ...


@dataclass(frozen=True)
class SourceRule:
    """Rule that turns the messages of one source into fields of a canonical topic.

    Parameters
    ----------
    source : str
        Name of the messages in the log.
    needs : tuple of str
        Columns without which the rule does not apply.
    columns : callable
        Numbers to canonical columns.
    derived : mapping of field to str
        What a user must know of a field.
    sampled : str
        Column with the time at which the values were true, on the clock of the messages; empty: that of the message.
    """

    source: str
    needs: tuple[str, ...]
    columns: Callable[[NumericColumns], Columns]
    derived: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    sampled: str = ""

    def told(self, topic: str) -> Iterator[Remark]:
        """Yield remarks on derived fields, one for all fields with the same text."""
        for text in dict.fromkeys(self.derived.values()):
            fields = tuple(name for name, one in self.derived.items() if one == text)
            yield Remark("derived", f"{topic}: {', '.join(fields)} from {text}", topic, fields)


@dataclass(frozen=True)
class Role:
    """Part of a canonical topic, and the rules for it, best first.

    ``has_instances``: each instance of the source is a topic of its own (``gnss.1``, ``gnss.2``).
    """

    topic: str
    rules: tuple[SourceRule, ...]
    has_instances: bool = False


@dataclass(frozen=True)
class OfferedMessages:
    """Messages that a log has: their name, number of the source, and columns.

    ``instance`` tells apart several sources of one name.
    """

    source: str
    instance: int
    columns: frozenset[str]

    def serves(self, rule: SourceRule) -> bool:
        """Tell whether a rule applies to these messages."""
        return self.source == rule.source and self.columns.issuperset(rule.needs)


@dataclass(frozen=True)
class Assignment:
    """Messages, and the canonical topic that they feed by a rule."""

    offer: OfferedMessages
    topic: str
    rule: SourceRule


def assigned(roles: Iterable[Role], offers: Sequence[OfferedMessages]) -> Iterator[Assignment]:
    """Yield, for each role, the first rule that the log serves and the messages that serve it.

    A role without instances takes only the first of these messages.
    """
    for role in roles:
        for rule in role.rules:
            instances = {offer.instance: offer for offer in offers if offer.serves(rule)}
            served = [offer for _instance, offer in sorted(instances.items())]
            is_numbered = role.has_instances and len(served) > 1
            for place, offer in enumerate(served if role.has_instances else served[:1], start=1):
                yield Assignment(offer, f"{role.topic}.{place}" if is_numbered else role.topic, rule)
            if served:
                break


def mapped(sources: Mapping[str, Sequence[str]], filled: Collection[str] | None = None) -> Iterator[Remark]:
    """Yield one remark that lists, by canonical topic, the names in the log that serve it.

    ``filled`` are the topics that have rows: of another one its sources hold no value. None: all have.

    Examples
    --------
    >>> [one.text for one in mapped({"air": ["WIND"], "electric": ["SYS_STATUS"]}, {"air"})]
    ['air from WIND; no electric: SYS_STATUS has no value of it']
    """
    told = [
        f"{topic} from {', '.join(names)}"
        if filled is None or topic in filled
        else f"no {topic}: {', '.join(names)} {'has' if len(names) == 1 else 'have'} no value of it"
        for topic, names in sorted(sources.items())
    ]
    if told:
        yield Remark("mapped", "; ".join(told))


def scaled(fields: Mapping[str, tuple[str, float]]) -> Callable[[NumericColumns], Columns]:
    """Return columns of plain factors: canonical field -> (column, factor)."""

    def columns(numbers: NumericColumns) -> Columns:
        return {field: Column(numbers[name] * factor) for field, (name, factor) in fields.items() if name in numbers}

    return columns


def holds(numbers: NumericColumns, name: str) -> BoolArray | None:
    """Return where a flag is set, shape (n,); None in messages that lack the flag."""
    return numbers[name] != 0.0 if name in numbers else None


def named(numbers: FloatArray, names: NDArray[np.str_]) -> Column:
    """Return the name that each number stands for; the last one for numbers beyond.

    Examples
    --------
    >>> kinds = np.array(["none", "fix", "other"])
    >>> named(np.array([0.0, 1.0, 7.0, -1.0, np.nan]), kinds).values.tolist()
    ['none', 'fix', 'other', 'other', 'other']
    """
    known = np.isfinite(numbers)
    last = len(names) - 1
    at = np.where(known & (numbers >= 0.0) & (numbers < last), numbers, last).astype(np.int64)
    return Column(names[at], known)


def pressure_altitude(pressure_pa: FloatArray) -> Columns:
    """Convert pressure to altitude in the standard atmosphere.

    Absent where the pressure cannot be that of the air.
    """
    altitude, is_refused = pressure_altitude_m(pressure_pa)
    return {"pressure_altitude_m": Column(altitude, ~is_refused)}


def direction(values_deg: FloatArray, present: BoolArray | None = None) -> Column:
    """Return a direction in [0, 360)."""
    return Column(np.asarray(wrap_360(values_deg)), present)
