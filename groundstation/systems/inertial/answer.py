"""Answer of the INS error estimator (system 2): INS errors against GNSS, and their basis."""

import math
from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.corrected_position import BestTrack, CorrectedPosition, MadeTrack
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults
from groundstation.results.frames import Brief, rows_frame
from groundstation.results.roles import AzimuthByTurns, AzimuthEstimate, ErrorsAlongTheFlight, KindOfIns
from groundstation.systems.inertial.arrays import InertialStates, InertialTrack

if TYPE_CHECKING:
    import pandas as pd

MISSING: dict[str, str] = {"gnss": "GNSS", "ins": "INS", "both": "both"}  # RealOutage.missing, for people
CHANNELS = ("north", "east")
QUANTITIES = ("position", "velocity")
STARTS = ("stated", "mode", "standstill", "unknown")
STATES = ("position", "velocity", "tilt", "drift", "drift_rate", "random_drift")
NOT_SEEN = 0.01  # observability below which the data said nothing of a state
UNMOVED = 0.01  # share of its sigma at the start by which the sigma of such a state may differ
LARGEST_SIGMA_M = 1e7  # more is no position on Earth
SUMMARY_ROUNDING = 1e-6  # rounding of a sigma in summary.json


@dataclass(frozen=True)
class StateEstimate:
    """One state of a channel at the last time GNSS was there.

    ``observability`` is 1 - sigma / sigma at the start (of the state alone, without GNSS), 0 to 1: near 0 the data say
    nothing about it. ``observable_from_s`` is the flight time from which it stays above one half, None if never.
    """

    schema_name: ClassVar[str] = "state"

    name: str = field(metadata={"one_of": STATES})  #: Stable name for scripts.
    title: str  #: Name for people.
    unit: str  #: Unit of value and sigma.
    value: float  #: Estimate at the last time GNSS was there.
    sigma: float  #: Its standard deviation.
    observability: float  #: 1 - sigma / sigma without GNSS: near 0 the data say nothing of it.
    observable_from_s: float | None  #: Flight second from which observability stays above one half; null if never.


@dataclass(frozen=True)
class ChannelResult(Brief):
    """One horizontal channel, ``north`` or ``east``.

    Error = INS - truth, innovation = measured - predicted. ``nis`` is the mean normalised innovation squared per
    measurement with its 95 % chi-square limits ``nis_low``, ``nis_high`` (None where the measurement noise was inflated
    for colour: then NIS is below one by design); ``share_inside95`` of the innovations inside their own 95 % band;
    ``rejected`` of ``innovations`` were gated.
    """

    schema_name: ClassVar[str] = "channel"

    name: str = field(metadata={"one_of": CHANNELS})  #: north or east.
    states: tuple[StateEstimate, ...]  #: Final estimates of the error states, INS minus truth.
    nis: float  #: Mean normalised innovation squared per measurement; 1 is honest.
    nis_low: float | None  #: Lower 95 % limit of NIS; null where the noise was inflated for colour.
    nis_high: float | None  #: Upper 95 % limit of NIS; null where the noise was inflated for colour.
    share_inside95: float  #: Share of the innovations inside their own 95 % band.
    innovations: int  #: Measurements that were compared.
    rejected: int  #: Measurements that the gate refused.
    velocity_error_rms_mps: float | None  #: RMS of the velocity error, INS minus GNSS.
    position_error_rms_m: float | None  #: RMS of the position error, INS minus GNSS.


@dataclass(frozen=True)
class RealOutage:
    """Interval of the log in which nothing could be compared.

    The filter forecast through it. ``jump_m`` is how far the forecast position error was from what GNSS showed at its
    end, ``sigma_m`` what the forecast claimed (both radial); None when the flight ended before. ``missing`` is what was
    absent: ``"gnss"``, ``"ins"`` or ``"both"``.
    """

    schema_name: ClassVar[str] = "outage"

    start_s: float
    end_s: float
    length_s: float  #: From the last comparison to the next.
    #: Forecast error against what GNSS showed at its end, radial; null when the flight ended before.
    jump_m: float | None
    sigma_m: float | None  #: Radial sigma that the forecast claimed there.
    missing: str = field(default="gnss", metadata={"one_of": tuple(MISSING)})  #: What was absent: gnss, ins or both.


@dataclass(frozen=True)
class Difference:
    """INS minus GNSS over the epochs compared.

    ``axis`` is ``north``, ``east``, or ``horizontal``, the length of both. ``mean`` has its sign; ``median``, ``p95``
    and ``largest`` are of the magnitude.
    """

    quantity: str = field(metadata={"one_of": QUANTITIES})  #: position or velocity.
    #: north, east, or horizontal: the length of both.
    axis: str = field(metadata={"one_of": (*CHANNELS, "horizontal")})
    unit: str  #: Unit of the figures.
    samples: int  #: Epochs compared.
    mean: float  #: Mean of INS minus GNSS, with its sign.
    median: float  #: Median of the magnitude.
    p95: float  #: 95th percentile of the magnitude.
    largest: float  #: Largest magnitude.


@dataclass(frozen=True)
class OwnInnovation:
    """Innovations against GNSS that the INS's own filter logged.

    Innovation = measured - predicted. ``mean`` has its sign; ``median`` and ``p95`` are of the magnitude. ``sigma`` is
    the root of the filter's median variance, ``share_inside95`` that of the innovations inside their 95 % band; None
    where it logs no variance. ``share_rejected`` is that of the samples beyond the filter's own gate, None where it
    logs no ratio to it.
    """

    quantity: str = field(metadata={"one_of": QUANTITIES})  #: position or velocity.
    axis: str = field(metadata={"one_of": CHANNELS})  #: north or east.
    unit: str
    samples: int  #: Innovations logged.
    mean: float  #: Mean of measured minus predicted, with its sign.
    median: float  #: Median of the magnitude.
    p95: float  #: 95th percentile of the magnitude.
    sigma: float | None  #: Root of the filter's median variance; null where it logs none.
    share_inside95: float | None  #: Share inside the filter's own 95 % band; null without a variance.
    share_rejected: float | None  #: Share beyond the filter's own gate; null where it logs no ratio.


@dataclass(frozen=True)
class Departure:
    """Span of flight seconds with an aided INS and GNSS far further apart than usual.

    Parameters
    ----------
    start_s, end_s : float
    largest_m, largest_mps : float or None
        Largest horizontal difference of position and velocity; None where it is not known.
    share_rejected : float or None
        Share of the span in which the filter was beyond its own gate for GNSS; None where it logs none.
    at_start : bool
        Whether the comparison had begun less than 30 s before: the filter was still finding its place.
    """

    start_s: float
    end_s: float
    largest_m: float | None  #: Largest horizontal distance of INS and GNSS in it; null where it is not known.
    largest_mps: float | None  #: Largest difference of their velocities; null where it is not known.
    share_rejected: float | None = None
    at_start: bool = False

    @property
    def apart(self) -> str:
        """Words on how far: "up to 181 m and 29.7 m/s "; empty where neither is known."""
        sizes = (
            "" if self.largest_m is None else f"{self.largest_m:.3g} m",
            "" if self.largest_mps is None else f"{self.largest_mps:.3g} m/s",
        )
        told = " and ".join(filter(None, sizes))
        return f"up to {told} " if told else ""


@dataclass(frozen=True)
class FilterOfIns:
    """Estimator that an INS topic is of, and whether it flew the aircraft.

    ``flew`` is None where the log does not tell; ``source`` is the parameter or field that does.
    """

    name: str = ""  #: Filter as the autopilot names it.
    flew: bool | None = None  #: Whether it flew the aircraft; null where the log does not tell.
    source: str = ""  #: Parameter or field that tells it.

    @property
    def title(self) -> str:
        """Name at the head of a line."""
        return self.name or "INS"

    @property
    def use(self) -> str:
        """Words on its use, to stand behind others."""
        if self.flew is None:
            return ""
        return f"; it {'flew' if self.flew else 'did not fly'} the aircraft ({self.source})"


@dataclass(frozen=True)
class NavigationStart:
    """Moment from which an INS navigates, and the evidence for it.

    ``time_s`` is in flight seconds, negative before the log, None where nothing proves it. ``basis`` is ``stated``,
    ``mode`` (a logged change from alignment), ``standstill`` (the log begins parked, with INS and GNSS together) or
    ``unknown``; ``reason`` says it for people.
    """

    time_s: float | None  #: Flight second, negative before the log; null where nothing proves it.
    #: stated, mode (a change from alignment is logged), standstill (the log begins parked) or unknown.
    basis: str = field(metadata={"one_of": STARTS})
    reason: str  #: The same for people.


@dataclass(frozen=True)
class InertialResult(Answer, KindOfIns, AzimuthByTurns, BestTrack, ErrorsAlongTheFlight):
    """INS errors of one flight.

    For an INS that GNSS corrects already, it only has the differences from GNSS.

    Parameters
    ----------
    ins_topic, gnss_topic : str
        The pair used.
    kind : str
        ``"unaided"``; ``"gnss_aided"`` for an INS that GNSS corrects; ``"unknown"`` where the log is too short or at
        rest for too long to tell. Of the last two ``differences`` are all that is told: there are no channels, rates,
        outages or class. ``kind_reason`` says why.
    ins_class : str
        Noise parameters used, by name; ``ins_class_origin`` says who chose them.
    transition : str
        ``"exact"`` or ``"first_order"`` (I + A T of the paper).
    epochs, gnss_seconds
        Epochs compared, and seconds of the flight with GNSS.
    radial_error_rate_50_nmiph, radial_error_rate_95_nmiph : float or None
        Radial position error over the time since navigation began (or the INS was reset), nautical miles per hour,
        median and 95 % over epochs later than ten minutes after it. None where nothing proves the start.
    radial_error_rate_fit_nmiph : float or None
        The time-position fit of the same error, the figure of the acceptance: slope through the origin by least
        squares over all epochs since navigation began. None where the median is.
    largest_radial_error_m, largest_radial_error_at_s : float or None
        Largest radial position error, and its flight time; ``largest_radial_error_utc`` that in UTC, if known.
    navigation_start : NavigationStart or None
        When navigation began; None of an INS that GNSS corrects.
    radial_error_first_m, radial_error_last_m : float or None
        Radial position error at the first and the last epoch with GNSS: the growth inside the log.
    compared_hours : float or None
        Between these two.
    differences : tuple of Difference
        INS minus GNSS of an INS that GNSS corrects.
    own_filter : str
        Topic of the log in which that INS tells of its own filter, empty where it does not; ``own_innovations`` are
        what it tells.
    departures : tuple of Departure
        Spans in which an INS that GNSS corrects left it, in order of time; ``filter_of_ins`` is the estimator it is of.
    outages : tuple of RealOutage
        Intervals of the log itself without GNSS or without the INS.
    reopened : int
        Number of times that GNSS was rejected for so long that the filter was opened to it again.
    other_ins : tuple of str
        INS topics of the log that were not used.
    settings : dict
        Every parameter of model, noise and gates as used.
    figures : tuple of FigureData
        ``inertial_states``, ``inertial_observability``, ``inertial_track``; of an INS that GNSS corrects
        ``inertial_differences``, ``inertial_track`` and, where its filter is logged, ``inertial_own_innovations``.
    """

    analysis: ClassVar[str] = "inertial"
    schema_name: ClassVar[str] = analysis

    ins_topic: str  #: Topic of the INS judged.
    gnss_topic: str  #: Topic of the GNSS that it is compared with.
    kind: str = field(metadata={"one_of": ("unaided", "gnss_aided", "unknown")})
    kind_reason: str  #: What shows the kind, for people.
    epochs: int  #: Epochs compared.
    gnss_seconds: float  #: Seconds of the flight with GNSS.
    ins_class: str = ""
    ins_class_origin: str = ""  #: Where the class comes from, in words.
    transition: str = field(default="exact", metadata={"one_of": ("exact", "first_order")})
    north: ChannelResult | None = None  #: Errors of the north channel; null where GNSS corrects the INS.
    east: ChannelResult | None = None  #: Errors of the east channel; null where GNSS corrects the INS.
    #: Median of radial position error over time since navigation began; null where the start is not known.
    radial_error_rate_50_nmiph: float | None = None
    radial_error_rate_95_nmiph: float | None = None  #: 95th percentile of the same rate.
    radial_error_rate_fit_nmiph: float | None = None
    velocity_error_rms_mps: float | None = None  #: RMS of the horizontal velocity error, both channels together.
    largest_radial_error_m: float | None = None  #: Largest radial position error, INS minus GNSS.
    largest_radial_error_at_s: float | None = None  #: Flight second of that error.
    largest_radial_error_utc: str = ""  #: UTC of that error, ISO 8601; empty without.
    navigation_start: NavigationStart | None = None
    radial_error_first_m: float | None = None  #: Radial position error at the first epoch with GNSS.
    radial_error_last_m: float | None = None  #: Radial position error at the last epoch with GNSS.
    compared_hours: float | None = None  #: Hours between the first and the last epoch compared.
    differences: tuple[Difference, ...] = ()
    own_filter: str = ""
    own_innovations: tuple[OwnInnovation, ...] = ()  #: What the filter of an aided INS logs of its innovations.
    departures: tuple[Departure, ...] = ()
    #: Which filter of the autopilot the INS is, and whether it flew; null where it is none.
    filter_of_ins: FilterOfIns = field(default_factory=FilterOfIns)
    outages: tuple[RealOutage, ...] = ()
    azimuth: AzimuthEstimate | None = None  #: Heading error by turns in flight; null where there is no estimate.
    reopened: int = 0
    other_ins: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def channels(self) -> tuple[ChannelResult, ...]:
        """Both channels; none of an INS that GNSS corrects."""
        return tuple(channel for channel in (self.north, self.east) if channel is not None)

    def difference(self, quantity: str, axis: str = "horizontal") -> Difference | None:
        """INS minus GNSS of a quantity along an axis, None where there is none."""
        return next((row for row in self.differences if (row.quantity, row.axis) == (quantity, axis)), None)

    @property
    def worst_departure(self) -> Departure | None:
        """Departure with the largest distance, but for those of a filter that just began."""
        found = [one for one in self.departures if not one.at_start]
        return max(found, key=lambda one: (one.largest_m or 0.0, one.largest_mps or 0.0), default=None)

    def best_track(self, results: FlightResults) -> CorrectedPosition | None:
        """The rows with a place and sigmas; None of an INS that was not corrected."""
        track, states = results.rows_of(InertialTrack), results.rows_of(InertialStates)
        if track is None or states is None or len(track) != len(states):
            return None
        if track.corrected_latitude_deg is None or track.corrected_longitude_deg is None:
            return None
        columns = [track.time_s, track.corrected_latitude_deg, track.corrected_longitude_deg]
        columns += [states.north.position_sigma_m, states.east.position_sigma_m]
        known = np.isfinite(columns).all(axis=0) & (np.abs(columns[3:]) < LARGEST_SIGMA_M).all(axis=0)
        return CorrectedPosition(*(column[known] for column in columns)) if known.any() else None

    def tracks(self, results: FlightResults) -> tuple[MadeTrack, ...]:
        """Return the INS less its estimated error, with sigmas, and less its smoothed error."""
        track, states = results.rows_of(InertialTrack), results.rows_of(InertialStates)
        if track is None:
            return ()
        made = []
        if track.corrected_latitude_deg is not None and track.corrected_longitude_deg is not None:
            rows = _placed(track.time_s, track.corrected_latitude_deg, track.corrected_longitude_deg)
            sigmas: tuple[FloatArray, ...] = ()
            if states is not None:
                both = states.north.position_sigma_m, states.east.position_sigma_m
                sigmas = tuple(np.interp(rows[0], states.time_s, sigma) for sigma in both)
            made.append(MadeTrack("corrected", "INS less its estimated error", *rows, *sigmas))
        if track.reference_latitude_deg is not None and track.reference_longitude_deg is not None:
            rows = _placed(track.time_s, track.reference_latitude_deg, track.reference_longitude_deg)
            made.append(MadeTrack("smoothed", "INS less its smoothed error", *rows))
        return tuple(made)

    def table_names(self) -> tuple[str, ...]:
        """Names that :meth:`to_frame` takes."""
        return ("states", "channels", *(name for name in super().table_names() if not name.endswith(".states")))

    def to_frame(self, table: str = "states") -> "pd.DataFrame":
        """Return a list of rows as a frame (see :class:`Tabular`).

        ``states`` are those of both channels.
        """
        if table == "channels":
            return rows_frame(ChannelResult, self.channels)
        if table != "states":
            return super().to_frame(table)
        rows = [(channel.name, state) for channel in self.channels for state in channel.states]
        frame = rows_frame(StateEstimate, [state for _, state in rows])
        frame.insert(0, "channel", [name for name, _ in rows])
        return frame


def _placed(
    time_s: FloatArray, latitude_deg: FloatArray, longitude_deg: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times and places of the rows that have a place."""
    known = np.isfinite(latitude_deg) & np.isfinite(longitude_deg)
    return time_s[known], latitude_deg[known], longitude_deg[known]


def is_left_alone(name: str, sigma: Any, observability: Any, settings: Mapping[str, Any]) -> bool:
    """Tell whether a state is not estimated in this INS class.

    The data say nothing of it, and its sigma is the one it had. A class leaves a state out by a tiny sigma at the
    start; value and sigma are then no answer of this flight.

    Parameters
    ----------
    name : str
        Name of the state; ``drift``, ``drift_rate`` and ``random_drift`` are the ones a class may leave out.
    sigma, observability
        Values of the :class:`StateEstimate`; what is not a number is not judged.
    settings : mapping
        ``InertialResult.settings``: the sigma at the start stands there.

    Examples
    --------
    >>> is_left_alone("drift_rate", 5e-6, 3e-6, {"noise.drift_rate_dphph": 5e-6})
    True
    >>> is_left_alone("drift", 0.0048, 0.45, {"noise.drift_dph": 0.0088})
    False
    """
    start = settings.get(f"noise.{name}_dphph" if name == "drift_rate" else f"noise.{name}_dph")
    known = all(isinstance(value, int | float) and math.isfinite(value) for value in (start, sigma, observability))
    if start is None or not known or observability >= NOT_SEEN:
        return False
    return math.isclose(sigma, start, rel_tol=UNMOVED, abs_tol=SUMMARY_ROUNDING)
