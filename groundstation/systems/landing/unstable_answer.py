"""Share of unstable approaches in a folder of flights, by runway and aircraft."""

from typing import Any, Literal

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.serial import to_json
from groundstation.results.figures import FigureData

Decision = Literal["pass", "fail", "not enough flights", "not flown", "no limit"]


@dataclass(frozen=True)
class JudgedApproach:
    """An approach of a folder under the standard.

    ``verdict`` is empty where none was measured; ``reason`` says why, or which criteria were not met.
    """

    flight_id: str
    aircraft: str
    runway: str
    number: int
    outcome: str
    verdict: str
    reason: str


@dataclass(frozen=True)
class UnstableShare:
    """Share of unstable approaches of a group, with the interval of Wilson.

    ``gone_around`` counts those of the unstable ones that ended in a go-around.
    """

    group: str
    name: str
    judged: int
    unstable: int
    gone_around: int
    share: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class UnstableApproaches:
    """Approaches of a folder held against a standard.

    Parameters
    ----------
    name, title, source, sha256 : str
        Of the standard.
    decision : str
        By the interval of all approaches against ``share_at_most``; *no limit* without one.
    shares : tuple of UnstableShare
        All approaches first, then by runway, then by aircraft.
    approaches : tuple of JudgedApproach
    left_out : tuple of str
        Flights that were not judged, with the reason.
    """

    name: str
    title: str
    source: str
    sha256: str
    version: str
    height_m: float
    confidence: float
    share_at_most: float | None
    decision: Decision
    flights: int
    shares: tuple[UnstableShare, ...]
    approaches: tuple[JudgedApproach, ...]
    left_out: tuple[str, ...] = ()

    @property
    def table(self) -> FigureData:
        """One row for each approach."""
        names = ("flight_id", "aircraft", "runway", "outcome", "verdict", "reason")
        columns: dict[str, Any] = {
            name: np.array([getattr(one, name) for one in self.approaches], dtype=np.str_) for name in names
        }
        columns["number"] = np.array([one.number for one in self.approaches], dtype=np.int64)
        return FigureData("approaches", columns, {"number": 0})

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        document: dict[str, Any] = to_json(self)
        return document
