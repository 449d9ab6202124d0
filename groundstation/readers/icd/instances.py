"""Which unit each word or message belongs to: two that feed the same signal are two units, ``ins.1`` and ``ins.2``."""

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from groundstation.readers.icd.model import Element, Message1553, Word429

Holder: TypeAlias = Word429 | Message1553


@dataclass
class _Unit:
    """A piece of equipment of one kind: where it speaks, and the signals that are known of it."""

    place: Hashable
    signals: set[str] = field(default_factory=set)


def numbered(
    words: tuple[Word429, ...], messages: tuple[Message1553, ...]
) -> tuple[tuple[Word429, ...], tuple[Message1553, ...]]:
    """Words and messages whose signals found by name are numbered where there are several units of a kind.

    A unit is all words of a bus, or all messages of a terminal; of two messages of one terminal that hold the same
    signal (inertial alone and blended with GNSS) each is a unit. Signals that the ICD states are left as they are.
    The words and messages of an ICD that are found in a log are numbered anew.
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
    return tuple(made[: len(words)]), tuple(made[len(words) :])


def _holding(holder: Any, elements: list[Any]) -> Any:
    return replace(holder, elements=tuple(elements))


def _plain(holder: Holder) -> Any:
    """The holder with the signals found by name as they are without numbers."""
    return _holding(holder, [_unnumbered(one) for one in holder.elements])


def _unnumbered(element: Element) -> Element:
    topic, _, name = (element.signal or "").rpartition(".")
    return replace(element, signal=f"{topic.partition('.')[0]}.{name}") if element.is_by_name else element


def _by_kind(holder: Holder) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for element in holder.elements:
        if element.is_by_name and element.signal:
            found.setdefault(element.signal.partition(".")[0], set()).add(element.signal)
    return found


def _place(holder: Holder) -> Hashable:
    if isinstance(holder, Word429):
        return "429", holder.bus, holder.channel, holder.subchannel
    return "1553", holder.bus, holder.channel, (holder.transmit or holder.receive) >> 11


def _unit_of(units: list[_Unit], place: Hashable, signals: set[str]) -> int:
    """Number of the unit that speaks there and has none of the signals yet; a new one where there is none."""
    for number, unit in enumerate(units):
        if unit.place == place and not unit.signals & signals:
            unit.signals |= signals
            return number
    units.append(_Unit(place, set(signals)))
    return len(units) - 1


def _renamed(element: Element, at: int, chosen: dict[tuple[int, str], int], several: set[str]) -> Element:
    kind, _, name = (element.signal or "").partition(".")
    if not element.is_by_name or kind not in several:
        return element
    return replace(element, signal=f"{kind}.{chosen[at, kind] + 1}.{name}")
