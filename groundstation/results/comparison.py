"""Answer of ``compare``: two saved flights with their clocks aligned, everywhere B less A."""

import math
from dataclasses import asdict
from typing import Any, Literal, TypeAlias, TypeGuard

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.quantiles import NORMAL_95
from groundstation.results.figures import FigureData
from groundstation.results.flight import NotAssessable

Event = Literal["start", "first-movement", "lift-off", "outage", "utc"]
Value: TypeAlias = float | str | bool | None


@dataclass(frozen=True)
class Side:
    """One of the two flights, by its names; ``start_utc`` is None without absolute time."""

    flight_id: str
    aircraft: str
    flight: str
    source_name: str
    source_sha256: str
    start_utc: str | None
    duration_s: float | None


@dataclass(frozen=True)
class ClockAlignment:
    """Event that both clocks are aligned on, with its flight seconds in A and in B."""

    event: Event
    a_s: float
    b_s: float

    @property
    def offset_s(self) -> float:
        """Seconds to add to the flight seconds of B to get those of A.

        Examples
        --------
        >>> ClockAlignment("lift-off", 120.0, 95.5).offset_s
        24.5
        """
        return self.a_s - self.b_s


@dataclass(frozen=True)
class Delta:
    """One answer of both flights.

    Parameters
    ----------
    name : str
        Path in ``results`` of summary.json: ``heading.error_deg``, ``forecast.skill.smoothed_start.30min.rms_m``.
    a, b : float, str, bool or None
    delta : float or None
        B less A; of directions within [-180, 180).
    sigma : float or None
        Sigma of the difference, from the sigmas both state, taken as independent; None where one states none.
    is_main : bool
        True where it stands in the short table.
    title : str
        What it is in words, where its name is that of a column.
    """

    name: str
    a: Value
    b: Value
    delta: float | None = None
    sigma: float | None = None
    is_main: bool = False
    title: str = ""

    @property
    def is_significant(self) -> bool | None:
        """Tell whether the difference is beyond its 95 % bound; None without a sigma.

        Examples
        --------
        >>> Delta("heading.error_deg", 1.0, 1.5, 0.5, 0.2).is_significant, Delta("x", 1.0, 2.0, 1.0).is_significant
        (True, None)
        """
        if self.delta is None or self.sigma is None or not math.isfinite(self.delta) or self.sigma <= 0.0:
            return None
        return abs(self.delta) > NORMAL_95 * self.sigma

    @property
    def is_different(self) -> bool:
        """Tell whether the two answers differ."""
        return self.a != self.b


@dataclass(frozen=True)
class SettingPair:
    """Setting, or version of a program, that differs.

    It is None where a flight has none of that name.
    """

    name: str
    a: Value
    b: Value


@dataclass(frozen=True)
class Comparison:
    """Two flights compared.

    Parameters
    ----------
    a, b : Side
    is_same_log : bool
        Both are of one log, or of parts of it: their noise is shared.
    alignment : ClockAlignment
    deltas : tuple of Delta
        Every answer both have.
    settings : tuple of SettingPair
    findings_a, findings_b : tuple of Finding
        Findings that only one of them has, by severity, code and topic.
    not_assessable_a, not_assessable_b : tuple of NotAssessable
        Analyses that only the other one has.
    are_sessions : bool
        Both are sessions of several aircraft, each with a log.
    """

    a: Side
    b: Side
    is_same_log: bool
    alignment: ClockAlignment
    deltas: tuple[Delta, ...]
    settings: tuple[SettingPair, ...] = ()
    findings_a: tuple[Finding, ...] = ()
    findings_b: tuple[Finding, ...] = ()
    not_assessable_a: tuple[NotAssessable, ...] = ()
    not_assessable_b: tuple[NotAssessable, ...] = ()
    are_sessions: bool = False

    @property
    def origin(self) -> str:
        """Common origin of both, where they share it."""
        return "the same logs" if self.are_sessions else "one log"

    @property
    def cause(self) -> str:
        """Cause of the differences between two flights of one log.

        It is empty where they are of two logs.
        """
        if not self.is_same_log:
            return ""
        is_whole = self.a.source_sha256 == self.b.source_sha256
        return "the settings" if is_whole else "the parts they hold and the settings"

    @property
    def shown(self) -> tuple[Delta, ...]:
        """The short table: the main answers, and any other that differs beyond its sigma."""
        return tuple(delta for delta in self.deltas if delta.is_main or delta.is_significant)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        document = asdict(self)
        document["alignment"]["offset_s"] = self.alignment.offset_s
        for plain, delta in zip(document["deltas"], self.deltas, strict=True):
            plain["is_significant"] = delta.is_significant
        return document

    def to_figure(self) -> FigureData:
        """The whole table as figure data: numbers and texts in columns of their own."""
        significant = {None: "", True: "yes", False: "no"}
        columns = {
            "name": np.array([delta.name for delta in self.deltas], dtype=np.str_),
            "a": np.array([_number(delta.a) for delta in self.deltas]),
            "b": np.array([_number(delta.b) for delta in self.deltas]),
            "delta": np.array([_number(delta.delta) for delta in self.deltas]),
            "sigma": np.array([_number(delta.sigma) for delta in self.deltas]),
            "significant": np.array([significant[delta.is_significant] for delta in self.deltas], dtype=np.str_),
            "a_text": np.array([_text(delta.a) for delta in self.deltas], dtype=np.str_),
            "b_text": np.array([_text(delta.b) for delta in self.deltas], dtype=np.str_),
        }
        return FigureData("compare", columns, {})


def _is_number(value: Value) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _number(value: Value) -> float:
    return float(value) if _is_number(value) else math.nan


def _text(value: Value) -> str:
    return "" if value is None or _is_number(value) else str(value)
