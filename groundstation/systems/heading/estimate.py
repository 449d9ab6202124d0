"""The heading estimator: from the tables of a flight to a verdict and a number to type."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from groundstation.methods.taxi.samples import HeadingOf, OnGround, logged_heading
from groundstation.results.roles import Delays
from groundstation.systems.heading.answer import HeadingResult, HeadingStep
from groundstation.systems.heading.outcome import build_answer
from groundstation.systems.heading.settings import HeadingRequest, HeadingSettings
from groundstation.systems.heading.solution import solve
from groundstation.systems.heading.steady import steady_prior
from groundstation.systems.heading.steps import heading_steps
from groundstation.systems.heading.taxi import StraightTaxi, taxi_of_flight
from groundstation.systems.heading.unproven_ground import is_found_to_roll, is_left_out, on_ground_throughout
from groundstation.systems.known import AircraftData, SiteData
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight


def estimate_heading_error(
    flight: Flight,
    *,
    on_ground: OnGround | None = None,
    heading: HeadingOf | None = None,
    settings: HeadingSettings | None = None,
    aircraft: AircraftData | None = None,
    site: SiteData | None = None,
    request: HeadingRequest | None = None,
    latencies: Delays | None = None,
    phases: Phases | None = None,
    weather: Iterable[str] = (),
) -> HeadingResult:
    """Estimate the INS heading error from straight taxi before take-off.

    Where that taxi is shorter than ``taxi_min_s``, the ground runs after the flight are used too (``runs`` in the
    settings); the gate ``before_take_off`` then fails, so that the verdict is reject and nothing is to be typed.

    Parameters
    ----------
    flight : Flight
        Topics ``ins`` (true heading) and ``gnss`` (velocities); ``discrete``, ``onboard`` where there are any.
    on_ground : callable, optional
        Ground contact at corrected times, e.g. ``lambda t: ground_mask(flight, t)``; default: logged weight on wheels.
    heading : callable, optional
        True heading of an INS topic, e.g. ``lambda topic: true_heading(flight, topic)``; default: as logged.
    settings, aircraft, site, request : optional
    latencies : Delays, optional
        Where that of GNSS behind the INS is observed, GNSS times are put back by it; the aircraft file's comes first.
    phases : Phases, optional
        Phases of the flight: take-off run and landing roll are not taxi and not used. Where they find, and nobody
        states, that the vehicle rolls, straight epochs of unproven ground are heard: the gate ``unproven_ground``.
    weather : iterable of str
        METAR lines: the wind of the one nearest in time is used where the log has none.

    Returns
    -------
    HeadingResult
        error = INS heading - true heading at ``reference_time_s``; ``correction_deg`` only with the verdict accept.

    Raises
    ------
    NotAssessableError
        With the reason: no heading, no velocity, never fast enough, never straight, too little before take-off.

    Notes
    -----
    On straight taxi the track equals the true heading, so the mean of d = INS heading - track is the error. The
    running mean, its precision e and the quality are the paper's; the estimate and its interval come from a noise model
    (``interval.py``) in which errors are correlated over seconds. Steady sideslip is not seen from one direction: what
    a known wind makes of it is taken off, the rest is in the interval. The mounting of the INS is part of the error.

    Source: Markelov, Kostishin, Shukalov, Heading correction of an INS before take-off by satellite navigation,
    Information and Control Systems 2015 No 6.
    """
    settings, aircraft = settings or HeadingSettings(), aircraft or AircraftData()
    site, request = site or SiteData(), request or HeadingRequest()
    chosen = partial(
        taxi_of_flight,
        flight,
        settings=settings,
        aircraft=aircraft,
        request=request,
        heading=heading,
        latencies=latencies,
        phases=phases,
    )
    judged = partial(
        _answer, flight, heading=heading, settings=settings, aircraft=aircraft, site=site, weather=tuple(weather)
    )
    taxi, whole = chosen(on_ground=on_ground), None
    if is_found_to_roll(phases) and is_left_out(taxi.samples, settings).any():
        whole = judged(chosen(on_ground=on_ground_throughout))
    return judged(taxi, whole=whole)


def _answer(
    flight: Flight,
    taxi: StraightTaxi,
    *,
    heading: HeadingOf | None,
    settings: HeadingSettings,
    aircraft: AircraftData,
    site: SiteData,
    weather: tuple[str, ...],
    whole: HeadingResult | None = None,
) -> HeadingResult:
    """Return the answer by the samples of a taxi.

    ``whole`` is that with its epochs of unproven ground.
    """
    antenna, standstill, delay = taxi.samples, taxi.standstill, taxi.delay
    span_s = tuple(float(time_s) for time_s in antenna.time_s[antenna.is_used][[0, -1]])
    steady = steady_prior(flight, span_s, aircraft, settings, site, weather)
    steps = _steps(flight, taxi.topics[0], heading, (standstill.start_s(antenna), span_s[1]), settings)
    offset_s = max(settings.offset_prior_sigma_s, settings.offset_prior_intervals * antenna.interval_s)
    if delay:  # what its latency leaves of the prior
        offset_s = min(offset_s, delay.sigma_s)
    at_rate = replace(settings, offset_prior_sigma_s=offset_s)  # a slow receiver is later, and differs more
    solution = solve(antenna, standstill, aircraft, at_rate, steady, steps)
    result = build_answer(flight, taxi.topics, solution, standstill, settings, aircraft, site, steady, whole)
    if delay is None:
        return result
    return replace(
        result, latency_used_s=delay.latency_s, latency_used_sigma_s=delay.sigma_s, latency_origin=delay.origin
    )


def _steps(
    flight: Flight, ins_topic: str, heading: HeadingOf | None, span_s: tuple[float, float], settings: HeadingSettings
) -> tuple[HeadingStep, ...]:
    """Steps of the INS heading over a span of flight time."""
    given = heading(ins_topic) if heading else logged_heading(flight, ins_topic)
    time_s = flight.time_s(ins_topic)
    inside = (time_s >= span_s[0]) & (time_s <= span_s[1])
    return heading_steps(time_s[inside], np.asarray(given.values_deg)[inside], settings)
