"""Chapter on the heading error with and without what earlier flights of the INS taught."""

from collections.abc import Sequence

from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.chapters.gates import VERDICTS
from groundstation.chapters.parts import Claim, Facts, Grid, Head, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, clean, interval, is_number, number, typeset
from groundstation.results.flight import FlightResults
from groundstation.results.installations import Installed, LearnedHeading
from groundstation.results.roles import IntervalPart
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.claim_chapter import PARTS, to_enter
from groundstation.systems.heading.installation.answer import InstallationResult

TITLE = "Installation, learned"
LEAD = "What earlier flights of the same INS in the same aircraft say of its mounting and of the aircraft's crab."
HEADS = (Head("Number"), Head("This taxi alone", True), Head("With earlier flights", True), Head("95 %", True))


def installation(results: FlightResults) -> Section | None:
    """Return the chapter; None without an answer."""
    answer = results.answer(InstallationResult)
    if answer is None:
        return None
    heading = results.answer(HeadingResult)
    step = 0.1 if heading is None else heading.entry_step_deg
    if answer.why_not:
        return Section("installation", TITLE, LEAD, (nothing_learned(answer),), not_learned(answer))
    told = Claim(
        Rank.HEADING,
        VERDICTS[answer.verdict],
        what_to_enter(answer, step),
        value=number(answer.error_deg, 2, "°", signed=True),
        remark=f"95 % {interval(answer.confidence95_deg, 2, '°')}",
        sentences=(sentence(answer),),
        figures=(("Heading error", number(answer.error_deg, 3, "°", signed=True), sources(answer)),),
        to_sign=answer.verdict == "accept",
    )
    return Section("installation", TITLE, LEAD, parts(answer), told.headline, claim=told)


def parts(answer: LearnedHeading) -> tuple[Part, ...]:
    """Return the parts of a report on a learned answer."""
    if answer.why_not:
        return (nothing_learned(answer),)
    return kept((Note(sentence(answer)), _both(answer), _installed(answer.installed), _doubts(answer)))


def not_learned(answer: LearnedHeading) -> str:
    """Return in one line why nothing was learned."""
    return f"Nothing learned of the installation: {typeset(answer.why_not)}"


def nothing_learned(answer: LearnedHeading) -> Note:
    """Return why nothing was learned, as a note."""
    return Note(f"{not_learned(answer)}.", "unknown")


def what_to_enter(answer: LearnedHeading, step_deg: float) -> str:
    """Return the number to type, or what to do instead."""
    width = f"± {_arcmin(answer.half_width_deg)}"
    return to_enter(answer.verdict, answer.correction_deg, width, step_deg)


def sources(answer: LearnedHeading) -> str:
    """Return the parts of the interval in words.

    For example "this taxi ± 6′, wind ± 4′, installation of serial S from 7 flights ± 3′".
    """
    return _parts(answer.interval_parts, answer)


def sentence(answer: LearnedHeading) -> str:
    """Return the learned answer in a sentence or two: verdict, number, half width, parts."""
    what = f"{VERDICTS[answer.verdict].text}: heading error {number(answer.error_deg, 3, '°', signed=True)}"
    enter = f", enter {number(answer.correction_deg, 2, '°', signed=True)}" if is_number(answer.correction_deg) else ""
    taught = (
        f"With what {answer.flights} earlier {_flights(answer.flights)} of serial {clean(answer.ins_serial)} taught"
    )
    return (
        f"{taught}: {what} ± {_arcmin(answer.half_width_deg)}{enter}; by this taxi alone "
        f"{number(answer.alone_error_deg, 3, '°', signed=True)} ± {_arcmin(answer.alone_half_width_deg)}. "
        f"Its parts: {sources(answer)}."
    )


def _parts(listed: Sequence[IntervalPart], answer: LearnedHeading) -> str:
    names = {**PARTS, "installation": f"installation of serial {clean(answer.ins_serial)} from {answer.flights} "}
    names["installation"] += _flights(answer.flights)
    return ", ".join(f"{names.get(one.name, one.name)} ± {_arcmin(one.half_width_deg)}" for one in listed)


def _flights(count: int) -> str:
    return "flight" if count == 1 else "flights"


def _arcmin(value_deg: float) -> str:
    return number(value_deg * ARCMIN_PER_DEG, 0, "′")


def _both(answer: LearnedHeading) -> Grid:
    platform = answer.platform_confidence95_deg
    rows = [
        (
            "Heading error of the airframe, typed",
            f"{number(answer.alone_error_deg, 3, '°', signed=True)} ± {_arcmin(answer.alone_half_width_deg)}",
            f"{number(answer.error_deg, 3, '°', signed=True)} ± {_arcmin(answer.half_width_deg)}",
            interval(answer.confidence95_deg, 3, "°"),
        ),
        (
            "Azimuth error of the platform",
            ABSENT,
            number(answer.platform_error_deg, 3, "°", signed=True),
            ABSENT if platform is None else interval(platform, 3, "°"),
        ),
    ]
    caption = f"Parts of the platform's interval: {_parts(answer.platform_parts, answer)}."
    if is_number(answer.residual_deg) and is_number(answer.residual_sigma_deg):
        caption += (
            f" The turns of this flight show an azimuth that differs from it by "
            f"{number(answer.residual_deg, 3, '°', signed=True)} (σ {number(answer.residual_sigma_deg, 3, '°')}); "
            "nothing of them is in the number."
        )
    return Grid("Heading error, alone and with the installation learned", HEADS, rows, caption)


def _installed(found: Installed | None) -> Facts | None:
    if found is None:
        return None
    pairs = (
        ("Mounting of the unit", _with_sigma(found.mounting_deg, found.mounting_sigma_deg), "INS case minus airframe"),
        ("Sideslip the same in every direction", _with_sigma(found.steady_deg, found.steady_sigma_deg), ""),
        ("Both together", _with_sigma(found.sum_deg, found.sum_sigma_deg), "what the taxis see"),
        (
            "Crosswind factor",
            f"{number(found.factor, 3)} (σ {number(found.factor_sigma, 3)})",
            "degrees of sideslip for each m/s of crosswind",
        ),
    )
    return Facts("What the earlier flights say", pairs)


def _with_sigma(value: float, sigma: float) -> str:
    return f"{number(value, 3, '°', signed=True)} (σ {number(sigma, 3, '°')})"


def _doubts(answer: LearnedHeading) -> Note | None:
    told = []
    if answer.changed:
        told.append(f"From {', '.join(map(clean, answer.changed))} on the unit sits otherwise, under the same serial.")
    if answer.odd:
        told.append(f"Taken for flights of another unit: {', '.join(map(clean, answer.odd))}.")
    return Note(" ".join(told), "warn") if told else None
