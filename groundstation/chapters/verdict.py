"""The claim of the heading correction: the verdict in a word, what to enter, why, and the figures it rests on."""

import re
from collections.abc import Mapping

from groundstation.chapters.gates import failed_to_inform
from groundstation.chapters.parts import Claim, Mark, Rank
from groundstation.chapters.wording import ABSENT, interval, is_number, number, step_places, typeset
from groundstation.results.heading import HeadingResult

PUBLISHED_LIMIT_ARCMIN = 20.0
VERDICTS: Mapping[str, Mark] = {
    "accept": Mark("good", "Accept"),
    "reject": Mark("bad", "Reject"),
    "extend": Mark("warn", "Extend"),
    "undecided": Mark("unknown", "Undecided"),
}
ADVICE: Mapping[str, str] = {
    "reject": "Enter no correction",
    "extend": "No correction yet: measure longer",
    "undecided": "No correction: a required gate was not measured",
}
NOT_ASSESSABLE = Mark("unknown", "Not assessable")


def claim(heading: HeadingResult) -> Claim:
    """The verdict with the number to type, or why there is none."""
    return Claim(
        Rank.HEADING_OPEN if heading.verdict == "undecided" else Rank.HEADING,
        VERDICTS[heading.verdict],
        what_to_enter(heading),
        value=number(heading.error_deg, 2, "°", signed=True),
        remark=f"95 % {interval(heading.confidence95_deg, 2, '°')}",
        sentences=reasons(heading),
        figures=figures(heading),
        to_sign=heading.verdict == "accept",
    )


def what_to_enter(heading: HeadingResult) -> str:
    """The number to type with its sign and the digits of the entry step; never one where there is nothing to type."""
    if heading.verdict != "accept":
        return ADVICE[heading.verdict]
    step, correction = heading.entry_step_deg, heading.correction_deg
    if is_number(correction) and correction:
        return f"Enter {number(correction, step_places(step), '°', signed=True)}"
    return f"Nothing to enter: the error is below half the entry step of {number(step, step_places(step), '°')}"


def reasons(heading: HeadingResult) -> tuple[str, ...]:
    """Why the verdict is what it is, what failed beside it, and the error in words."""
    why = typeset(re.split(r": enter |\. Not to be entered", heading.verdict_reason)[0])  # told by the headline
    each = (sentence(part) for part in why.split("; "))
    found = failed_to_inform(heading.gates), _in_words(heading), steady_terms(heading)
    return tuple(filter(None, (*each, *found)))


def steady_terms(heading: HeadingResult) -> str:
    """What of the interval this taxi shows, and what steady sideslip and mounting add; empty where not known."""
    measured, sigma = heading.confidence95_measured_deg, heading.steady_sigma_deg
    if measured is None or not all(map(is_number, measured)) or not is_number(sigma):
        return ""
    driven = "the directions driven do not remove" if heading.directions else "this taxi cannot show"
    origin = "as the aircraft file states" if heading.steady_origin == "aircraft file" else "shipped figures"
    return (
        f"95 % interval {interval(heading.confidence95_deg, 3, '°')}, including steady sideslip and mounting that "
        f"{driven} (σ {number(sigma, 2, '°')}, {origin}); {interval(measured, 3, '°')} from this taxi alone."
    )


def sentence(text: str) -> str:
    """Text with a capital and a full stop.

    Examples
    --------
    >>> sentence("every required gate passed"), sentence("Why?")
    ('Every required gate passed.', 'Why?')
    """
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if not text or text[-1] in ".!?" else ".")


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
    """The figures that decide, each with what it rests on."""
    samples, taxi = number(heading.samples, 0), number(heading.taxi_seconds, 0, "s")
    shown, sigma = number(heading.parking_ins_heading_deg, 2, "°"), number(heading.parking_sigma_deg, 2, "°")
    remark = f"95 % interval {interval(heading.confidence95_deg, 3, '°')}"
    found = (
        ("Heading error", number(heading.error_deg, 3, "°", signed=True), remark),
        ("Precision e", number(heading.precision_deg, 3, "°"), f"{samples} samples, {taxi} of straight taxi"),
        ("Parking heading, corrected", number(heading.parking_heading_deg, 2, "°"), f"INS showed {shown}; σ {sigma}"),
        _against_reference(heading),
    )
    return tuple(figure for figure in found if figure[1] != ABSENT)


def _against_reference(heading: HeadingResult) -> tuple[str, str, str]:
    residual, reference = heading.reference_residual_arcmin, number(heading.reference_parking_heading_deg, 2, "°")
    remark = f"reference {reference}; runs of Markelov 2015: within {PUBLISHED_LIMIT_ARCMIN:.0f}′"
    return ("Against the reference", number(residual, 1, "′", signed=True), remark)
