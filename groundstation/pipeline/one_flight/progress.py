"""Progress of a run as events: the pipeline sends them, the command line shows them."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, TypeAlias

from groundstation.base.dataclasses import dataclass

if TYPE_CHECKING:
    from groundstation.pipeline.one_flight.outcome import Outcome

EventKind = Literal["begin", "stage", "end"]


@dataclass(frozen=True)
class Event:
    """One step of a run.

    Parameters
    ----------
    kind : {'begin', 'stage', 'end'}
        ``begin`` of everything (``total`` items), a ``stage`` of one item, ``end`` of one item.
    name : str
        The item: a log's name.
    text : str
        The stage (``"reading"``) or the result in a few words.
    total : int
    outcomes : tuple of Outcome
        What became of the item that ends: one each flight of it.
    """

    kind: EventKind
    name: str = ""
    text: str = ""
    total: int = 0
    outcomes: "tuple[Outcome, ...]" = ()


Listener: TypeAlias = Callable[[Event], None]


def silent(event: Event) -> None:
    """Ignore an event."""
