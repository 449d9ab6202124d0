"""Answer of an acceptance: INS figures of a folder of flights against a standard's limits."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number, required_number
from groundstation.results.arrays.acceptance import AcceptanceCurves, AcceptanceGrowth

Claim = Literal["type", "units", "these"]
Decision = Literal["pass", "fail", "not enough flights", "not flown", "no limit"]
ENSEMBLE = ""  # where an INS is named and all of them are meant
UNKNOWN_INS = "unknown"  # flights of which no one says which INS it was: they may be of one, and are taken so


@dataclass(frozen=True)
class Quantity:
    """A figure of a flight that a limit may bound: title and unit sign for people."""

    title: str
    unit: str


QUANTITIES: Mapping[str, Quantity] = {
    "radial_rate_fit_nmiph": Quantity("radial error rate, time-position fit", "nmi/h"),
    "radial_rate_final_nmiph": Quantity("radial error at the end over the hours", "nmi/h"),
    "radial_final_nmi": Quantity("radial error at the end", "nmi"),
    "radial_largest_nmi": Quantity("largest radial error", "nmi"),
    "along_largest_nmi": Quantity("largest along-track error", "nmi"),
    "cross_largest_nmi": Quantity("largest cross-track error", "nmi"),
    "velocity_error_rms_mps": Quantity("velocity error, RMS", "m/s"),
    "heading_error_deg": Quantity("heading error on taxi", "°"),
}


@dataclass(frozen=True)
class Bound:
    """Largest allowed magnitude of a figure of a flight, named as in :data:`QUANTITIES`."""

    quantity: str
    at_most: float = required_number(1e-9)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.quantity not in QUANTITIES:
            raise SettingsError("quantity", repr(self.quantity), f"one of {', '.join(QUANTITIES)}")


@dataclass(frozen=True)
class AcceptanceLimit:
    """One limit: on at least ``share`` of the flights every bound holds.

    ``paragraph`` is its place in the standard; ``hours_over`` < hours <= ``hours_up_to`` are the flights it is for.
    """

    name: str
    title: str
    bounds: tuple[Bound, ...]
    paragraph: str = ""
    share: float = number(0.95, 0.5, 0.9999)
    hours_over: float = number(0.0, 0.0, 1000.0)
    hours_up_to: float | None = number(None, 0.0, 1000.0)
    note: str = ""

    def __post_init__(self) -> None:
        check_ranges(self)
        if not self.bounds:
            raise SettingsError("bounds", "none", "at least one")
        if self.hours_up_to is not None and self.hours_up_to <= self.hours_over:
            raise SettingsError("hours_up_to", f"{self.hours_up_to:g}", f"more than hours_over = {self.hours_over:g}")

    def is_for(self, hours: float) -> bool:
        """Tell whether a flight of so many hours is judged by it."""
        return self.hours_over < hours <= (float("inf") if self.hours_up_to is None else self.hours_up_to)

    def part(self, values: Mapping[str, float]) -> float | None:
        """Return the figures of a flight as a part of the limit, by the worst bound.

        More than one is over the limit; None is not measured.

        Examples
        --------
        >>> AcceptanceLimit("a", "", (Bound("heading_error_deg", 0.5),)).part({"heading_error_deg": -0.25})
        0.5
        """
        parts = [abs(values[one.quantity]) / one.at_most for one in self.bounds if one.quantity in values]
        return max(parts) if len(parts) == len(self.bounds) else None


@dataclass(frozen=True)
class Standard:
    """Limits with their source, as a TOML file states them.

    Parameters
    ----------
    title, source : str
    read : str
        Parts of the text at hand when the figures were written down; shown beside them.
    layout : str
        Order and titles of the page: ``"acceptance"``, or ``"irig261"``.
    confidence : float
        Confidence of every claim, one-sided.
    claim : str
        ``"type"``: the INS flown stand for all of their kind, flights of one count by their correlation; ``"units"``:
        the same, every INS counts once; ``"these"``: the claim is on the INS flown alone, every flight counts.
    minutes_min : float
        A flight with less navigation is left out.
    accuracy_ratio_min : float or None
        Limit over the error of the reference (both 95 %) that a flight needs to count; None: it is told alone.
    limits : tuple of AcceptanceLimit
    """

    title: str
    source: str
    read: str = ""
    layout: Literal["acceptance", "irig261"] = "acceptance"
    confidence: float = number(0.95, 0.5, 0.9999)
    claim: Claim = "type"
    minutes_min: float = number(10.0, 1.0, 6000.0)
    accuracy_ratio_min: float | None = number(None, 0.0, 1e6)
    limits: tuple[AcceptanceLimit, ...] = ()

    def __post_init__(self) -> None:
        check_ranges(self)
        names = [limit.name for limit in self.limits]
        if len(set(names)) < len(names):
            raise SettingsError("limits", "two of one name", "names that differ")


@dataclass(frozen=True)
class FlightError:
    """INS errors of one flight; what is left out has a ``reason`` and perhaps no figures.

    ``is_read`` is false where its results cannot be read: nobody knows what it would show.
    ``ins`` names the unit: its serial where the log or the aircraft file says one, else aircraft and topic, else
    :data:`UNKNOWN_INS`.
    ``hours`` are those from the first position compared to the last; radial errors are INS minus reference.
    ``reference95`` is by what the reference itself may err in 95 % of cases, by quantity.
    """

    flight_id: str
    ins: str
    aircraft: str
    alignment: str
    start_utc_ns: int | None
    source: str
    sha256: str
    made_by: str
    reason: str = ""
    is_read: bool = True
    hours: float = 0.0
    epochs: int = 0
    values: Mapping[str, float] = field(default_factory=dict)
    reference95: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_included(self) -> bool:
        """Tell whether the flight enters the figures."""
        return not self.reason


@dataclass(frozen=True)
class InsRow:
    """Figures from the flights of one INS, or of all (``ins`` is :data:`ENSEMBLE`).

    Parameters
    ----------
    cep50_rate_nmiph, r95_rate_nmiph, two_drms_rate_nmiph : float or None
        Slope through the origin of the error that half (95 %) of the flights stay within at a time, and of twice its
        root mean square; None with too few flights.
    along95_nmi, cross95_nmi : float or None
        95 % of the flights' largest errors along and across the track.
    velocity_rms_mps : float or None
        Over all epochs.
    heading95_deg, heading_largest_deg : float or None
        Over the flights with a heading error that was not rejected; ``heading_flights`` are those.
    """

    ins: str
    aircraft: str
    alignment: str
    flights: int
    hours: float
    fit_median_nmiph: float | None
    fit_largest_nmiph: float | None
    cep50_rate_nmiph: float | None
    r95_rate_nmiph: float | None
    two_drms_rate_nmiph: float | None
    along95_nmi: float | None
    cross95_nmi: float | None
    velocity_rms_mps: float | None
    heading_flights: int
    heading95_deg: float | None
    heading_largest_deg: float | None


@dataclass(frozen=True)
class Judgement:
    """One limit against the flights of one INS, or of all: decision, confidence, missing data.

    Parameters
    ----------
    flights, over, ins_units : int
        Flights judged, those over the limit, distinct INS.
    not_measured : int
        Flights that the limit is for, but of which a figure that it bounds is missing: they are not judged.
    effective_flights : float
        Independent flights that they are worth: flights of one INS are alike.
    correlation : float
        Correlation of two flights of one INS that this was reckoned with, 0 to 1.
    share_low, share_high : float
        One-sided limits of the share of flights within, each at the confidence of the standard.
    share_low_these : float
        ``share_low`` if only these INS are meant: their flights taken as independent.
    share_bound : float or None
        Upper limit, at that confidence, of what the share asked for stays below: an order statistic of the flights,
        as a part of the limit; None where there are too few flights for any.
    flights_needed : int
        Independent flights that the claim takes, those over now among them.
    more_with_none_over : int
        Flights more, none over, with which the limit is passed; 0 where it is.
    more_at_present_share : int or None
        The same if as many of them are over as now; None where that never passes it.
    accuracy_ratio : float or None
        Smallest over the flights of limit over the error of the reference, both 95 %.
    """

    limit: str
    ins: str
    decision: Decision
    flights: int
    over: int
    ins_units: int
    not_measured: int
    effective_flights: float
    correlation: float
    share_low: float
    share_high: float
    share_low_these: float
    share_bound: float | None
    flights_needed: int
    more_with_none_over: int
    more_at_present_share: int | None
    accuracy_ratio: float | None


@dataclass(frozen=True)
class Acceptance:
    """Everything an acceptance report shows.

    ``judgements`` are of the ensemble first, then by INS. ``growth`` has radial errors against hours of navigation:
    ``hours``, ``flights``, ``cep50_nmi``, ``r95_nmi``, ``two_drms_nmi``, ``bound95_nmi``; ``curves`` those of the
    flights: ``flight`` (its place in ``included``), ``hours``, ``radial_nmi``.
    """

    name: str
    standard: Standard
    standard_sha256: str
    version: str
    decision: Decision
    flights: tuple[FlightError, ...]
    rows: tuple[InsRow, ...]
    judgements: tuple[Judgement, ...]
    growth: AcceptanceGrowth
    curves: AcceptanceCurves
    settings: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def included(self) -> tuple[FlightError, ...]:
        """Flights that enter the figures."""
        return tuple(flight for flight in self.flights if flight.is_included)

    def limit(self, name: str) -> AcceptanceLimit:
        """The limit of that name."""
        return next(limit for limit in self.standard.limits if limit.name == name)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values, the arrays left out."""
        from groundstation.base.serial import to_json

        document: dict[str, Any] = to_json(self)
        return document
