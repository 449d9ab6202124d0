"""Units of words and messages: two that feed the same signal are ``ins.1`` and ``ins.2``."""

from collections.abc import Hashable
from dataclasses import field, replace
from typing import Any, TypeAlias

from groundstation.base.dataclasses import dataclass
from groundstation.readers.icd.model import Element, Element429, Message1553, Word429

Holder: TypeAlias = Word429 | Message1553


@dataclass
class _Unit:
    """Equipment of one kind: its place on the buses, and its known signals."""

    place: Hashable
    signals: set[str] = field(default_factory=set)


def numbered(
    words: tuple[Word429, ...], messages: tuple[Message1553, ...]
) -> tuple[tuple[Word429, ...], tuple[Message1553, ...]]:
    """Number words and messages where there are several units of a kind.

    Only signals found by name are numbered.

    A unit is all words of a bus, or all messages of a terminal; of two messages of one terminal that hold the same
    signal (inertial alone and blended with GNSS) each is a unit. Signals that the ICD states are left as they are.
    The words and messages of an ICD that are found in a log are numbered anew. A fine part feeds the signal of the
    word to which it is added.
    """
    holders: list[Holder] = [*map(_plain, words), *map(_plain, messages)]
    units: dict[str, list[_Unit]] = {}
    chosen: dict[tuple[int, str], int] = {}
    for at, holder in enumerate(holders):
        for kind, signals in _by_kind(holder).items():
            chosen[at, kind] = _unit_of(units.setdefault(kind, []), _place(holder), signals)
    several = {kind for kind, found in units.items() if len(found) > 1}
    made = [
        _holding(holder, [_renamed(one, at, chosen, several) for one in holder.elements])
        for at, holder in enumerate(holders)
    ]
    return _with_fine(made[: len(words)]), tuple(made[len(words) :])


def _with_fine(words: list[Word429]) -> tuple[Word429, ...]:
    """Make fine parts feed the signal of their word on the same bus."""
    coarse = {(_place(word), word.name): word.elements[0] for word in words if word.elements}

    def of(word: Word429, element: Element429) -> Element429:
        one = coarse.get((_place(word), element.fine_of))
        return element if one is None else replace(element, signal=one.signal, factor=one.factor)

    return tuple(_holding(word, [of(word, element) for element in word.elements]) for word in words)


def _holding(holder: Any, elements: list[Any]) -> Any:
    return replace(holder, elements=tuple(elements))


def _plain(holder: Holder) -> Any:
    """Return the holder without numbers in the signals that were found by name."""
    return _holding(holder, [_unnumbered(one) for one in holder.elements])


def _is_numbered(element: Element) -> bool:
    """Tell whether the signal was found by name; a fine part has that of its word."""
    return element.is_by_name and not (isinstance(element, Element429) and element.fine_of)


def _unnumbered(element: Element) -> Element:
    topic, _, name = (element.signal or "").rpartition(".")
    return replace(element, signal=f"{topic.partition('.')[0]}.{name}") if _is_numbered(element) else element


def _by_kind(holder: Holder) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for element in holder.elements:
        if _is_numbered(element) and element.signal:
            found.setdefault(element.signal.partition(".")[0], set()).add(element.signal)
    return found


def _place(holder: Holder) -> Hashable:
    if isinstance(holder, Word429):
        return "429", holder.bus, holder.channel, holder.subchannel
    return "1553", holder.bus, holder.channel, (holder.transmit or holder.receive) >> 11


def _unit_of(units: list[_Unit], place: Hashable, signals: set[str]) -> int:
    """Return the number of the unit at a place that has none of the signals yet.

    A new unit is made where there is none.
    """
    for number, unit in enumerate(units):
        if unit.place == place and not unit.signals & signals:
            unit.signals |= signals
            return number
    units.append(_Unit(place, set(signals)))
    return len(units) - 1


def _renamed(element: Element, at: int, chosen: dict[tuple[int, str], int], several: set[str]) -> Element:
    kind, _, name = (element.signal or "").partition(".")
    if not _is_numbered(element) or kind not in several:
        return element
    return replace(element, signal=f"{kind}.{chosen[at, kind] + 1}.{name}")
