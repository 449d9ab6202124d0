"""Roles of answers: facts that one system reads from another's answer without naming it.

An answer that plays a role is derived from it. A reader finds it with
:func:`groundstation.results.answer.answer_meeting`, ``results.answer_meeting`` or ``known.answer_meeting``.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.results.arrays.states import BodyStates
from groundstation.results.gates import Gate

FloatArray = NDArray[np.float64]
LETTERS = ("A", "B", "C", "D", "E")  # of the coefficients of a compass deviation


class Delay:
    """Delay of one sensor behind another that a flight shows; see :class:`Delays`.

    Positive: it shows a motion later by its time stamps.
    """

    latency_s: float | None
    sigma_s: float | None
    confidence95_s: tuple[float, float] | None


class Delays:
    """Role of an answer with delays between the sensors of a flight."""

    def observed(self, reference: str, other: str) -> Delay | None:
        """Delay of one topic behind another, None where it is not observed."""
        raise NotImplementedError


class KindOfIns:
    """Role of an answer that tells whether GNSS corrects an INS.

    ``kind`` is that of ``ins_topic``; the kinds stand in :mod:`groundstation.tables.sources`.
    """

    ins_topic: str
    kind: str

    @property
    def kinds(self) -> dict[str, str]:
        """The kind by topic."""
        return {self.ins_topic: self.kind}


@dataclass(frozen=True)
class EarlyAzimuth:
    """Azimuth error at flight time ``time_s``, and its drift.

    It rests on the turns of the first hour of turns alone. An azimuth error oscillates over 24 h: what is carried back
    to the taxi may not come from hours later.
    """

    error_deg: float  #: INS heading minus true heading at time_s.
    sigma_deg: float  #: Standard deviation of the error.
    time_s: float  #: Flight second that the error is of.
    rate_deg_per_h: float  #: Growth of the error.
    rate_sigma_deg_per_h: float  #: Standard deviation of the growth.
    correlation: float  #: Correlation of error and growth, -1 to 1.
    turns: int  #: Turns of the first hour.

    def at(self, time_s: float) -> tuple[float, float]:
        """The error and its sigma at another flight time, deg.

        Examples
        --------
        >>> seen = EarlyAzimuth(0.5, 0.03, 3600.0, 0.1, 0.02, 0.0, 4)
        >>> [round(value, 4) for value in seen.at(0.0)]
        [0.4, 0.0361]
        """
        hours = (time_s - self.time_s) / 3600.0
        grown = self.rate_sigma_deg_per_h * hours
        variance = self.sigma_deg**2 + grown**2 + 2.0 * self.correlation * self.sigma_deg * grown
        return self.error_deg + self.rate_deg_per_h * hours, max(variance, 0.0) ** 0.5


@dataclass(frozen=True)
class AzimuthEstimate:
    """Azimuth (heading) error of the INS, from the effect of turns on its velocity error.

    It is offered only where the turns allow it. ``observable`` says whether ``sigma_deg`` is below the limit of the
    settings; if not, ``error_deg`` is None. The error is that at ``time_s``, flight seconds: the last turn; ``early``
    is for the time of the taxi, None where the first hour shows too little.
    """

    schema_name: ClassVar[str] = "azimuth"

    observable: bool  #: Whether the sigma is below the limit of the settings.
    error_deg: float | None  #: INS heading minus true heading at time_s; null where not observable.
    sigma_deg: float | None  #: Standard deviation of the error.
    turns: int  #: Turns that it rests on.
    velocity_change_mps: float  #: Change of velocity by the turns, which shows it.
    reason: str  #: Why it is not observable, or what it rests on.
    time_s: float | None = None  #: Flight second of the last turn: the error is of then.
    #: The same by the first hour of turns, for the time of the taxi; null where that shows too little.
    early: EarlyAzimuth | None = None


class AzimuthByTurns:
    """Role of an answer with the azimuth error of an INS by its turns in flight."""

    ins_topic: str
    azimuth: AzimuthEstimate | None


@dataclass(frozen=True)
class IntervalPart:
    """One part of the interval of the error: ``taxi``, ``wind`` or ``installation``.

    The squares of the sigmas add up. ``half_width_deg`` is what the 95 % interval would be with this part alone.
    """

    name: str  #: taxi, wind or installation.
    sigma_deg: float  #: Its standard deviation: the squares add up.
    half_width_deg: float  #: Half of the 95 % interval with this part alone.


class HeadingByTrack:
    """Role of an answer with the heading error of an INS by its track on the ground.

    Error = INS heading - true heading. ``error_deg``, ``standard_error_deg`` and ``confidence95_deg`` are the
    airframe's, at ``reference_time_s``.
    """

    ins_topic: str
    error_deg: float
    standard_error_deg: float
    confidence95_deg: tuple[float, float]
    drift_deg_per_h: float | None
    drift_sigma_deg_per_h: float | None
    reference_time_s: float | None
    samples: int
    gates: tuple[Gate, ...]
    verdict: str
    verdict_reason: str
    settings: Mapping[str, float | str | bool]

    @property
    def failed_beside_interval(self) -> tuple[str, ...]:
        """Names of failed required gates whose finding ``standard_error_deg`` does not hold."""
        raise NotImplementedError

    @property
    def azimuth(self) -> tuple[float, float]:
        """Error of the platform's azimuth and its standard error, deg; the mounting taken off."""
        raise NotImplementedError

    @property
    def begins_s(self) -> float | None:
        """Flight second of the first straight part it rests on, None where there is none."""
        raise NotImplementedError

    def epochs_s(self) -> FloatArray:
        """Flight seconds of the epochs used, none where they are not kept."""
        raise NotImplementedError

    def seconds_used(self) -> float:
        """Seconds that the epochs used stand for."""
        raise NotImplementedError


class LatencyByTurns:
    """Role of an answer with the delay of GNSS behind the INS by the turns of a taxi.

    ``time_offset_s`` is the delay that they still show after ``latency_used_s`` was taken out; ``latency_origin`` is
    the origin of the latter: ``motion``, ``aircraft file`` or nothing.
    """

    ins_topic: str
    gnss_topic: str
    time_offset_s: float | None
    time_offset_sigma_s: float | None
    latency_used_s: float | None
    latency_origin: str


class CompassCoefficients:
    """Role of an answer with the coefficients of a compass deviation, by letter."""

    verdict: str
    coefficients_deg: Mapping[str, float]
    coefficients_sigma_deg: Mapping[str, float]


class OnTaxi:
    """Role of an answer that rests on stretches of the taxi: the map of the track marks them.

    ``taxi_serves`` says what they are used for: "the heading error".
    """

    taxi_serves: ClassVar[str]

    @property
    def taxi_used_s(self) -> tuple[tuple[float, float], ...]:
        """Ends of the stretches, flight seconds."""
        raise NotImplementedError


class Outage(Protocol):
    """Interval of a log in which nothing could be compared.

    ``missing`` is ``gnss``, ``ins`` or ``both``.
    """

    @property
    def start_s(self) -> float: ...
    @property
    def missing(self) -> str: ...


@dataclass(frozen=True)
class ReplayedForecasts:
    """Forecasts of the position error of an INS that were replayed on its flight.

    ``lead_s`` (n,) is the time after the start ``start_s`` (n,), flight seconds; ``forecast_m`` and ``sigma_m`` (n, 2)
    are the change of the error since the start, north and east, and its sigma.
    """

    method: str
    start_s: FloatArray
    lead_s: FloatArray
    forecast_m: FloatArray
    sigma_m: FloatArray


class ForecastOfErrors:
    """Role of an answer that forecasts the errors of an INS without GNSS."""

    def replayed(self) -> ReplayedForecasts | None:
        """Return the replayed forecasts of the method that is used, None where they are not kept."""
        raise NotImplementedError


class ErrorsAlongTheFlight:
    """Role of an answer with the errors of an INS along the flight.

    ``outages`` are the intervals of the log without GNSS or without the INS.
    """

    ins_topic: str
    outages: Sequence[Outage]


class StatesAlongTheFlight:
    """Role of an answer with position, velocity and attitude along the flight.

    Their sigmas stand beside them. ``states_name`` is that of its track and table.
    """

    states_name: ClassVar[str]

    @property
    def unit_topic(self) -> str:
        """Topic of the inertial unit it rests on."""
        raise NotImplementedError

    @property
    def gnss_topic(self) -> str:
        """Topic of the receiver it rests on."""
        raise NotImplementedError

    @property
    def is_reference(self) -> bool:
        """Tell whether its checks hold, so that others may be set against it."""
        raise NotImplementedError

    @property
    def by_it(self) -> str:
        """Words for what is found by it: "by the best trajectory (heading to 0.3 deg)"."""
        raise NotImplementedError

    @property
    def states_title(self) -> str:
        """Title of its track, with what is doubtful of it."""
        raise NotImplementedError

    @property
    def gnss_latency(self) -> tuple[float, float] | None:
        """Delay of the receiver behind the inertial unit and its sigma, s.

        None where it is not observable.
        """
        raise NotImplementedError

    def velocity_latency(self, ins_topic: str) -> tuple[float, float] | None:
        """Return the delay of GNSS velocities behind the output of an INS and its sigma, s.

        None where the log does not show it.
        """
        raise NotImplementedError

    @property
    def antenna_arm_m(self) -> tuple[float, float, float]:
        """Antenna from the point of the states: forward, right, down.

        It is 0 where it is not observable.
        """
        raise NotImplementedError

    def body_states(self) -> BodyStates | None:
        """Return the states, None where they are not kept."""
        raise NotImplementedError

    def states_at_antenna(self) -> BodyStates | None:
        """Return the states of the GNSS antenna, None where they are not kept."""
        states = self.body_states()
        return None if states is None else states.at_point(*self.antenna_arm_m)


@dataclass(frozen=True)
class FilterWrong:
    """Span in which an on-board filter was surely wrong.

    Parameters
    ----------
    span_s, whole_s : (float, float)
        Flight seconds of it, and of all that was judged.
    value, half95 : float
        Median error in it, and half of its 95 % interval.
    over : float
        What is sure of it, over the error that a report opens with.
    """

    span_s: tuple[float, float]
    whole_s: tuple[float, float]
    value: float
    half95: float
    over: float


@dataclass(frozen=True)
class FilterError:
    """Error of an on-board filter in one quantity.

    What is constant all through the log is not in it.

    Parameters
    ----------
    quantity, unit : str
        "heading", "horizontal position" ...
    rms, sigma_rms : float
        Of the error, and of what judges it.
    wrong : tuple of FilterWrong
        The worst first.
    constant : str
        Words on the constant and its cause; empty where there is none.
    changed : str
        Words on a change of the constant: the filter was wrong before or after; empty where there is none.
    """

    quantity: str
    unit: str
    rms: float
    sigma_rms: float
    wrong: tuple[FilterWrong, ...] = ()
    constant: str = ""
    changed: str = ""


class ErrorsOfFilter:
    """Role of an answer with the errors of on-board filters.

    Judged by states that do not come from it.
    """

    @property
    def filter_topics(self) -> tuple[str, ...]:
        """Topics of the filters whose errors are known, the one that flew the vehicle first.

        None are where the checks do not hold.
        """
        raise NotImplementedError

    @property
    def by_it(self) -> str:
        """Words for what is found by it: "by the best trajectory (heading to 0.3 deg)"."""
        raise NotImplementedError

    def filter_errors(self, topic: str) -> tuple[FilterError, ...]:
        """Return the errors of a filter by quantity."""
        raise NotImplementedError


class WordsOfRecord:
    """Role of an answer with words on a kind of signals for the line on the recording.

    ``words_of_record``: by kind of topic, ``{"gnss": "RTK fixed 65 %"}``.
    """

    @property
    def words_of_record(self) -> Mapping[str, str]:
        """Words by kind of topic."""
        raise NotImplementedError
