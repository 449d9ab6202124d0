"""Claim of the heading correction: the verdict, what to enter, why, and the figures."""

from collections.abc import Mapping

from groundstation.base.angles import wrap_180
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.chapters.gates import VERDICTS, failed_to_inform
from groundstation.chapters.parts import Claim, Rank
from groundstation.chapters.wording import (
    ABSENT,
    clock,
    interval,
    is_number,
    number,
    plural,
    step_places,
    typeset,
    with_full_stop,
)
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.gates_answer import LEAVES_OPEN, UNPROVEN, UNPROVEN_OPEN
from groundstation.systems.heading.reason_answer import why_alone

PUBLISHED_LIMIT_ARCMIN = 20.0
PARTS: Mapping[str, str] = {"taxi": "this taxi", "wind": "wind", "installation": "installation"}
SAME_EVERYWHERE = (
    "It holds for even power and free brakes: one engine, or a brake that drags, adds 9 to 24′ that nothing shows, not "
    "even there and back."
)
UNEVEN_POWER = "Uneven power is stated: what it may add is in the interval, under installation."
ADVICE: Mapping[str, str] = {
    "reject": "Enter no correction",
    "extend": "No correction yet: measure longer",
    "undecided": "No correction: a required gate was not measured",
}


def claim(heading: HeadingResult) -> Claim:
    """Return the verdict with the number to type, or why there is none."""
    is_open = any(gate.name in LEAVES_OPEN and gate.state == "failed" for gate in heading.gates)
    return Claim(
        Rank.HEADING_OPEN if heading.verdict == "undecided" or is_open else Rank.HEADING,
        VERDICTS[heading.verdict],
        what_to_enter(heading),
        value=number(heading.error_deg, 2, "°", signed=True),
        remark=f"95 % {interval(heading.confidence95_deg, 2, '°')}",
        sentences=reasons(heading),
        figures=figures(heading),
        to_sign=heading.verdict == "accept",
    )


def what_to_enter(heading: HeadingResult) -> str:
    """Return the number to type, or words instead of it where nothing is to be typed."""
    width = half_width(heading.confidence95_deg)
    return to_enter(heading.verdict, heading.correction_deg, width, heading.entry_step_deg)


def to_enter(verdict: str, correction_deg: float | None, half_width: str, step_deg: float) -> str:
    """Return the number to type, with its sign and the digits of the entry step.

    Words instead of a number where nothing is to be typed. ``half_width`` is in words: "± 12′".
    """
    if verdict == "advisory":
        return f"Good to {half_width} only: taxi the other way, or state the wind"
    if verdict != "accept":
        return ADVICE[verdict]
    if is_number(correction_deg) and correction_deg:
        return f"Enter {number(correction_deg, step_places(step_deg), '°', signed=True)}"
    return f"Nothing to enter: the error is below half the entry step of {number(step_deg, step_places(step_deg), '°')}"


def reasons(heading: HeadingResult) -> tuple[str, ...]:
    """Return why the verdict is what it is, failed side checks, and the error in words."""
    each = [with_full_stop(typeset(part)) for part in why_alone(heading.verdict_reason)]  # the headline says the rest
    left = _left_out(heading)
    return tuple(
        filter(None, (*each, left, _in_words(heading), *steady_terms(heading), failed_to_inform(heading.gates)))
    )


def _left_out(heading: HeadingResult) -> str:
    """Return how many straight epochs are left out.

    Empty where none is, or where the reason of the verdict says it.
    """
    gates = [one for one in heading.gates if one.name in (UNPROVEN, UNPROVEN_OPEN)]
    if heading.unproven_ground is None or not gates or any(one.state == "failed" for one in gates):
        return ""
    return with_full_stop(typeset(gates[0].reason))


def half_width(ends: tuple[float, float]) -> str:
    """Return the half width of an interval in arcminutes, as ± figure."""
    return f"± {number(0.5 * (ends[1] - ends[0]) * ARCMIN_PER_DEG, 0, '′')}"


def steady_terms(heading: HeadingResult) -> tuple[str, ...]:
    """Return the shares of this taxi, the wind and the installation in the interval.

    The text also says whose error it is: the airframe's or the platform's. Empty where the steady sideslip is not
    known.
    """
    if not is_number(heading.steady_sigma_deg):
        return ()
    power = UNEVEN_POWER if heading.settings.get("aircraft.taxi_power") == "uneven" else SAME_EVERYWHERE
    return tuple(filter(None, (_parts(heading), power, _typed(heading))))


def _parts(heading: HeadingResult) -> str:
    """Return the parts of the interval, each as the half width it would have alone."""
    parts = (
        f"{PARTS.get(one.name, one.name)} ± {number(one.half_width_deg * ARCMIN_PER_DEG, 0, '′')}"
        for one in heading.interval_parts
    )
    told = ", ".join(parts)
    wind = heading.wind
    known = (
        f" Sideslip of {number(heading.sideslip_deg, 2, '°', signed=True)} by the wind ({wind.origin}) is taken off."
        if wind
        else ""
    )
    origin = ", by the aircraft file" if heading.steady_origin == "aircraft file" else ""
    return f"95 %, {half_width(heading.confidence95_deg)}: {told}{origin}.{known}" if told else ""


def _typed(heading: HeadingResult) -> str:
    """Return which of the two numbers is typed, and the other with its own half width."""
    ends = heading.platform_confidence95_deg
    if ends is None or not all(map(is_number, ends)):
        return ""
    azimuth = number(heading.platform_error_deg, 3, "°", signed=True)
    return (
        "This is the airframe's error, which is typed because the airframe is what is pointed and checked; the "
        f"platform's, mounting taken off, is {azimuth} {half_width(ends)}."
    )


def _in_words(heading: HeadingResult) -> str:
    error = heading.error_deg
    if not is_number(error):
        return "The heading error could not be estimated."
    if round(error, 2) == 0:
        return "INS heading agrees with the GNSS track within 0.01°."
    sense = "high" if error > 0 else "low"
    text = f"INS heading reads too {sense} by {number(abs(error), 2, '°')}"
    if heading.verdict == "accept":
        step = heading.entry_step_deg
        return f"{text}; entry step {number(step, step_places(step), '°')}."
    return f"{text}."


def figures(heading: HeadingResult) -> tuple[tuple[str, str, str], ...]:
    """Return the figures that decide, each with what it rests on."""
    samples, taxi = plural(heading.samples, "sample"), number(heading.taxi_seconds, 0, "s")
    remark = f"95 % interval {interval(heading.confidence95_deg, 3, '°')}"
    found = (
        ("Heading error", number(heading.error_deg, 3, "°", signed=True), remark),
        ("Precision e", number(heading.precision_deg, 3, "°"), f"{samples}, {taxi} of straight taxi"),
        ("Parking heading, corrected", number(heading.parking_heading_deg, 2, "°"), _parked(heading)),
        _against_reference(heading),
    )
    return tuple(figure for figure in found if figure[1] != ABSENT)


def _parked(heading: HeadingResult) -> str:
    """Return the heading shown and when, and the error then beside that on taxi."""
    stood, sigma = heading.standstill, number(heading.parking_sigma_deg, 2, "°")
    when = "" if stood is None else f" at {clock(stood.start_s)} – {clock(stood.end_s)}"
    shown = f"INS showed {number(heading.parking_ins_heading_deg, 2, '°')}{when}"
    if not is_number(heading.parking_ins_heading_deg) or not is_number(heading.parking_heading_deg):
        return f"{shown}; σ {sigma}"
    there = wrap_180(heading.parking_ins_heading_deg - heading.parking_heading_deg)
    then, on_taxi = (number(float(one), 2, "°", signed=True) for one in (there, heading.error_deg))
    at = "" if heading.reference_time_s is None else f" at {clock(heading.reference_time_s)}"
    return f"{shown}; its error then {then}, on taxi{at} {on_taxi}; σ {sigma}"


def _against_reference(heading: HeadingResult) -> tuple[str, str, str]:
    residual, reference = heading.reference_residual_arcmin, number(heading.reference_parking_heading_deg, 2, "°")
    remark = f"reference {reference}; runs of Markelov 2015: within {PUBLISHED_LIMIT_ARCMIN:.0f}′"
    return ("Against the reference", number(residual, 1, "′", signed=True), remark)
