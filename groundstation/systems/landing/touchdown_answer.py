"""Touchdown of an approach: time by its witnesses, place, manner."""

from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.words import clock_text
from groundstation.results.frames import Brief

SINK_S = 1.0  # before the touchdown, over which the sink rate is taken
LAST_SINK_S = 0.5  # the same behind the flare, where the best trajectory shows it
PEAK_S = 2.0  # about the touchdown, within which the peak load is sought

WitnessState = Literal["agrees", "disagrees", "not used"]


@dataclass(frozen=True)
class Witness:
    """A signal that shows the touchdown, with its own time and sigma.

    Parameters
    ----------
    name : str
        "normal acceleration", "pitch", ...
    topic : str
        Where it is logged; empty where it is not.
    rate_hz : float or None
        Samples a second around the touchdown.
    time_s, sigma_s : float or None
        Flight time that it alone shows, and half of the interval that holds 68 %; None where it shows none.
    state : {'agrees', 'disagrees', 'not used'}
        It disagrees where the fused time lies outside what it allows.
    reason : str
        Reason why it is not used.
    """

    name: str
    topic: str
    rate_hz: float | None
    time_s: float | None  #: Flight second that it alone shows; null where it shows none.
    sigma_s: float | None  #: Half of the interval that holds 68 %.
    state: WitnessState
    reason: str = ""


@dataclass(frozen=True)
class SecondContact:
    """A contact after the touchdown: a bounce, or a strut that rebounds.

    ``load_g`` is the normal acceleration there, ``found_by`` what shows it.
    """

    time_s: float  #: Flight second of the contact.
    load_g: float | None  #: Normal acceleration there.
    found_by: str  #: What shows it.


@dataclass(frozen=True, kw_only=True)
class TouchdownByStates:
    """Touchdown by states from raw inertial data, at the same time.

    Parameters
    ----------
    words : str
        "by the best trajectory (heading to 0.3 deg)".
    sink_rate_mps, sink_rate_sigma_mps : float
        Over the last ``SINK_S`` before it.
    last_sink_rate_mps : float
        Over the last ``LAST_SINK_S``: behind the flare.
    past_threshold_m : float or None
        Of the antenna along the runway; None where the threshold itself was placed by the touchdown.
    past_threshold_sigma_m : float
        Of the position alone; the time of the touchdown has a sigma of its own.
    """

    words: str
    sink_rate_mps: float  #: Sink rate just before, down positive.
    sink_rate_sigma_mps: float  #: Standard deviation of the sink rate.
    last_sink_rate_mps: float
    past_threshold_m: float | None
    past_threshold_sigma_m: float


@dataclass(frozen=True, kw_only=True)
class Touchdown(Brief):
    """Place, time and manner in which the wheels met the ground.

    Parameters
    ----------
    time_s, time_sigma_s : float
        Flight time, and its sigma (of the wider side of the interval).
    time_utc : str or None
        The same as date and time of day; None where the log has no UTC.
    confidence95_s : (float, float) or None
        Interval of the time; None where nothing but the phases shows it.
    found_by : str
        Witnesses that agree, or the phases where there are none.
    witnesses : tuple of Witness
        Every signal that could show the touchdown, used or not.
    place_sigma_m : float
        Of the place along the runway by the time alone: its sigma times the ground speed.
    past_threshold_m : float or None
        Along the runway; None where the threshold itself was placed by the touchdown.
    sink_rate_mps, sink_rate_sigma_mps : float or None
        Onto the runway, over the last ``SINK_S`` before it; ``sink_rate_by`` is the topic that shows it.
    runway_slope, runway_slope_sigma : float or None
        Rise of the ground along the roll-out, metres per metre.
    second_contacts : tuple of SecondContact
    peak_load_g : float or None
        Greatest normal acceleration within ``PEAK_S`` of it.
    rollout_course_deg : float or None
        True direction of the line through the positions of the roll-out.
    by_states : TouchdownByStates or None
        The same by the best trajectory, where its checks hold.
    """

    time_s: float  #: Flight second of the first contact.
    time_sigma_s: float  #: Standard deviation, by the wider side of the interval.
    found_by: str
    latitude_deg: float  #: Latitude of the place.
    longitude_deg: float  #: Longitude of the place.
    past_threshold_m: float | None
    ground_speed_mps: float | None  #: Ground speed there.
    sink_rate_mps: float | None  #: Sink rate onto the runway just before, down positive.
    peak_load_g: float | None
    rollout_course_deg: float | None
    by_states: TouchdownByStates | None = None
    time_utc: str | None = None  #: Date and time of day of the first contact, UTC; null where the log has none.
    confidence95_s: tuple[float, float] | None = None
    place_sigma_m: float | None = None
    sink_rate_sigma_mps: float | None = None  #: Standard deviation of the sink rate.
    sink_rate_by: str = ""  #: Topic that shows the sink rate.
    runway_slope: float | None = None  #: Rise of the ground along the roll-out, metres per metre.
    #: Standard deviation of the slope by the noise of the altitude; its drift is not in it.
    runway_slope_sigma: float | None = None
    witnesses: tuple[Witness, ...] = ()
    second_contacts: tuple[SecondContact, ...] = ()  #: Bounces, and struts that rebound.

    @property
    def moment(self) -> str:
        """Time of day to a second, ``13:33:15Z``; without UTC the flight time, ``44:34``."""
        return clock_text(self.time_s) if self.time_utc is None else f"{self.time_utc[11:19]}Z"
