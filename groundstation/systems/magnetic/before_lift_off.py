"""Ground before lift-off: where the INS heading may be aligned by the track.

The heading analysis is run there once more.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import EVENT_SEPARATOR, topics_of_kind
from groundstation.methods.roles import HeadingOnGround
from groundstation.methods.taxi.samples import HEADING_AND_VELOCITY
from groundstation.results.roles import HeadingByTrack
from groundstation.systems.magnetic.entered import corrections_entered
from groundstation.systems.magnetic.gyros import GyroDrift, gyro_drift
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.phases import Phases
from groundstation.tables.sources import choose_pair
from groundstation.tables.table import Flight

ANALYSIS = "magnetic"
NO_LIMIT_MPS = 1000.0  # lift-off ends the run, not a speed


@dataclass(frozen=True)
class GroundRuns:
    """Answers of the heading analysis on the ground, each None where there is none.

    Parameters
    ----------
    fast : HeadingByTrack or None
        Of what is faster than ``speed_min_mps`` before lift-off, the take-off run above all; ``why_not`` says why
        there is none. Looked for only where taxi is not what aligns.
    taxi : HeadingByTrack or None
        Of taxi within the speed limits of the heading analysis; ``why_not_taxi`` likewise.
    since : str
        What the answers begin with, if not with the log.
    """

    fast: HeadingByTrack | None = None
    taxi: HeadingByTrack | None = None
    speed_min_mps: float | None = None
    why_not: str = ""
    why_not_taxi: str = ""
    since: str = ""


@dataclass(frozen=True)
class AlignmentWindow:
    """Window of flight seconds in which the alignment may look.

    ``is_by_event``: an event bounds the window. ``since``: what it runs from.
    """

    start_s: float
    end_s: float
    is_by_event: bool
    since: str = ""


def least_speed_mps(velocity_error_mps: float, track_error_deg: float) -> float:
    """Return the speed from which on a velocity error turns the track by no more than allowed.

    The velocity error is across the track. tan(track error) = velocity error / speed.

    Examples
    --------
    The patent's: 0.15 m/s at 100 km/h makes 0.3 deg.

    >>> round(least_speed_mps(0.15, 0.309), 1), round(least_speed_mps(0.15, 0.3), 1)
    (27.8, 28.6)
    """
    return velocity_error_mps / math.tan(math.radians(track_error_deg))


def find_ground_runs(
    flight: Flight,
    ins_topic: str,
    heading: HeadingByTrack | None,
    phases: Phases,
    on_ground: HeadingOnGround | None,
    settings: MagneticSettings,
    *,
    is_enough: Callable[[HeadingByTrack], bool] = lambda _found: False,
) -> GroundRuns:
    """Find what aligns the INS heading on the ground.

    Taxi aligns by ``heading``, the heading analysis's own answer, else the run to lift-off does. Where events of the
    operator bound the alignment, or a correction was entered after the taxi had begun, taxi is judged again between
    them. The run counts where it is straight and fast enough for the track error allowed; with ``uses_slower_taxi`` it
    is not looked for where the answer from taxi ``is_enough``.
    """
    try:
        window = alignment_window(flight, phases, settings)
    except NotAssessableError as error:
        reason = _reason(error)
        if settings.alignment_event:
            return GroundRuns(why_not=reason, why_not_taxi=reason)
        return GroundRuns(taxi=heading, why_not=reason)
    part, taxi, why_not_taxi, since = _gnss_within(flight, window), heading, "", ""
    if window.is_by_event or (window.since and _begins_before(heading, window)):
        taxi, why_not_taxi = _estimated(on_ground, part, flight, ins_topic)
        since = window.since
    speed_min_mps = _speed_min_mps(part, ins_topic, settings)
    if settings.uses_slower_taxi and taxi is not None and taxi.ins_topic == ins_topic and is_enough(taxi):
        return GroundRuns(None, taxi, speed_min_mps, "taxi aligns", why_not_taxi, since)
    fast, why_not = _estimated(on_ground, part, flight, ins_topic, (speed_min_mps, NO_LIMIT_MPS))
    seconds = fast.seconds_used() if fast is not None else 0.0
    if fast is not None and seconds < settings.ground_run_min_s:
        fast, why_not = None, f"{seconds:.1f} s straight above {speed_min_mps:.1f} m/s before lift-off"
    return GroundRuns(fast, taxi, speed_min_mps, why_not, why_not_taxi, window.since if fast else since)


def _begins_before(heading: HeadingByTrack | None, window: AlignmentWindow) -> bool:
    """Tell whether an answer rests on data before a window."""
    return heading is None or heading.begins_s is None or heading.begins_s < window.start_s


def gyros_at_standstill(flight: Flight, ins_topic: str, phases: Phases, settings: MagneticSettings) -> GyroDrift | None:
    """Return the gyro drift at the standstill before lift-off, in the window of the alignment.

    None where not known.
    """
    try:
        window = alignment_window(flight, phases, settings)
    except NotAssessableError:
        return None
    return gyro_drift(flight, ins_topic, phases, window.start_s, window.end_s)


def alignment_window(flight: Flight, phases: Phases, settings: MagneticSettings) -> AlignmentWindow:
    """Return the window up to the first lift-off less a margin.

    The window begins with the last ``alignment_event`` and ends with the ``release_event`` after it. A correction
    entered on board may move the INS heading: what lies before the last one is left out.

    Raises
    ------
    NotAssessableError
        Without a lift-off or without the event.
    """
    airborne = np.flatnonzero(phases.phase == "airborne")
    if not airborne.size or airborne[0] == 0:
        raise NotAssessableError(ANALYSIS, "the log begins in the air" if airborne.size else "no lift-off is proven")
    end_s = float(phases.start_s[airborne[0]]) - settings.lift_off_margin_s
    start_s, is_by_event, since = 0.0, False, ""
    if settings.alignment_event:
        begun = [time for time in event_times_s(flight, settings.alignment_event) if time < end_s]
        if not begun:
            raise NotAssessableError(ANALYSIS, f"no event {settings.alignment_event!r} before lift-off")
        start_s, is_by_event, since = begun[-1], True, f"the event {settings.alignment_event!r}"
    entered = [one.time_s for one in corrections_entered(flight) if start_s < one.time_s < end_s]
    if entered:
        start_s, since = entered[-1], f"the correction entered at {entered[-1]:.0f} s"
    if settings.release_event:
        released = [time for time in event_times_s(flight, settings.release_event) if start_s < time < end_s]
        end_s, is_by_event = min([end_s, *released]), is_by_event or bool(released)
    return AlignmentWindow(start_s, end_s, is_by_event, since)


def event_times_s(flight: Flight, name: str) -> list[float]:
    """Flight seconds of the events of a name, in order of time."""
    found: list[float] = []
    for topic in topics_of_kind("event", flight.topics()):
        texts, time_s = flight[topic].text("name"), flight.time_s(topic)
        found += [float(time) for time, text in zip(time_s, texts, strict=True) if name in text.split(EVENT_SEPARATOR)]
    return sorted(found)


def _gnss_within(flight: Flight, window: AlignmentWindow) -> Flight:
    """The flight with the GNSS epochs of a window alone: they decide what is looked at."""
    cut = {}
    for topic in topics_of_kind("gnss", flight.topics()):
        time_s = flight.time_s(topic)
        cut[topic] = flight[topic].take((time_s >= window.start_s) & (time_s < window.end_s))
    return replace(flight, tables={**flight.tables, **cut})


def _speed_min_mps(part: Flight, ins_topic: str, settings: MagneticSettings) -> float:
    """Return the least speed by the velocity error allowed for.

    Where the receiver states a larger one, that counts.
    """
    stated = np.zeros(0)
    with suppress(NotAssessableError):  # said when the heading analysis is run
        _ins, gnss = choose_pair(part, HEADING_AND_VELOCITY, ins_topic)
        stated = part[gnss].values("velocity_sigma_mps")
    stated = stated[np.isfinite(stated)]
    error_mps = max(settings.gnss_velocity_error_mps, float(np.median(stated)) if stated.size else 0.0)
    return min(least_speed_mps(error_mps, settings.track_error_max_deg), NO_LIMIT_MPS)


def _estimated(
    on_ground: HeadingOnGround | None,
    part: Flight,
    flight: Flight,
    ins_topic: str,
    speeds_mps: tuple[float, float] | None = None,
) -> tuple[HeadingByTrack | None, str]:
    """Return the answer of the heading analysis, or the reason.

    Ground contact is judged by the whole flight, not by the part.
    """
    if on_ground is None:
        return None, "no analysis estimates the heading error on the ground"
    try:
        return on_ground.find(part, flight, ins_topic, speeds_mps), ""
    except NotAssessableError as error:
        return None, _reason(error)


def _reason(error: NotAssessableError) -> str:
    return str(error).removeprefix(f"{ANALYSIS}: ").removeprefix("heading: ")
