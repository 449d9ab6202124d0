"""Claims of the INS errors and of the forecast, and what to record and check for them.

How fast the INS drifts, and how far a forecast can go.
"""

from collections.abc import Iterator

from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.chapters.chapter import Advice
from groundstation.chapters.parts import Claim, Mark, Rank, Tone
from groundstation.chapters.wording import ABSENT, clock, is_number, number
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.forecast_answer import ForecastResult, SkillRow

WORDS: dict[Tone, str] = {"good": "Measured", "warn": "With care", "unknown": "Open"}
HOUR_MIN = 60.0  # the horizon a forecast is judged by at a glance, or the longest below it
PURPOSE = "INS errors"


def inertial_claim(answer: InertialResult, quality: str, *, is_doubtful: bool) -> Claim:
    """Return the drift of an INS that GNSS does not correct.

    ``quality`` says in a sentence whether the filter can be trusted; ``is_doubtful`` that its sigmas are too small.
    """
    rate, measure = drift_of(answer)
    drift = number(rate, 2, "nmi/h")
    if is_number(rate):
        is_stated = answer.navigation_start is not None and answer.navigation_start.basis == "stated"
        headline = f"Unaided INS, drifts {drift}"
        remark = f"{measure}; start of navigation as you stated it" if is_stated else measure
    elif is_start_unknown(answer):
        headline = f"INS error {growth(answer)}"
        remark = "no rate: nothing shows when navigation began"
    else:
        headline, remark = "INS errors measured, flight too short for a drift", ""
    found = (
        ("INS drift", drift, measure),
        ("Velocity error", number(answer.velocity_error_rms_mps, 2, "m/s"), "RMS"),
        ("Largest position error", *largest_of(answer)),
    )
    tone: Tone = "warn" if is_doubtful else "good"
    return Claim(
        Rank.INERTIAL,
        Mark(tone, WORDS[tone]),
        headline,
        value=drift if is_number(rate) else "",
        remark=remark,
        sentences=(quality,) if quality else (),
        figures=tuple(figure for figure in found if figure[1] != "—"),
    )


def largest_of(answer: InertialResult) -> tuple[str, str]:
    """Return the largest position error, and against what and when, in nautical miles too."""
    value = answer.largest_radial_error_m
    if not is_number(value):
        return ABSENT, ""
    at = answer.largest_radial_error_at_s
    miles = number(value / M_PER_NAUTICAL_MILE, 2, "nmi")
    return number(value, 0, "m"), f"{miles}, against GNSS" + (f", at {clock(at)}" if is_number(at) else "")


def lead_of(lead: str, topic: str, results: FlightResults) -> str:
    """Return the lead of a chapter on one INS; of a flight with several it names the one."""
    answer = results.answer(InertialResult)
    has_others = answer is not None and bool(answer.other_ins)
    return f"{lead} Of several INS, this is {topic}." if has_others else lead


def drift_of(answer: InertialResult) -> tuple[float | None, str]:
    """Return how fast the position error grows, nmi/h, and the measure of it.

    The measure is the median where an older version saved no fit.
    """
    if answer.radial_error_rate_fit_nmiph is None:
        return answer.radial_error_rate_50_nmiph, "median"
    return answer.radial_error_rate_fit_nmiph, "time-position fit"


def is_start_unknown(answer: InertialResult) -> bool:
    """Tell whether the start of navigation is unknown.

    False for answers of older versions, which did not look for it.
    """
    return answer.navigation_start is not None and answer.navigation_start.time_s is None


def growth(answer: InertialResult) -> str:
    """Return the position error at the ends of the log, and the time between them, in words."""
    minutes = None if answer.compared_hours is None else 60.0 * answer.compared_hours
    first, last = (number(error, 0, "m") for error in (answer.radial_error_first_m, answer.radial_error_last_m))
    return f"{first} at first, {last} after {number(minutes, 0, 'min')}"


def forecast_claim(answer: ForecastResult, sentences: tuple[str, ...], tone: Tone) -> Claim | None:
    """Return the error of the shipped forecast after an hour; None without an error.

    The horizon is the longest up to an hour, or the shortest where all are longer.
    """
    rows = [row for row in answer.skill if is_number(row.rms_m)]
    shipped = {row.horizon_min: row for row in rows if row.method == answer.default_method}
    if not shipped:
        return None
    horizon = max((lead for lead in shipped if lead <= HOUR_MIN), default=min(shipped))
    raw = _of("raw_ins", horizon, rows)
    value = number(shipped[horizon].rms_m, 0, "m")
    against = f"; raw INS {number(raw.rms_m, 0, 'm')}" if raw is not None else ""
    title, remark = f"Forecast, {horizon:g} min", f"RMS after {horizon:g} min without GNSS{against}"
    return Claim(
        Rank.FORECAST,
        Mark(tone, WORDS[tone]),
        f"Forecast off by {value} after {horizon:g} min without GNSS",
        value,
        remark,
        sentences,
        ((title, value, f"RMS{against}"),),
    )


def _of(method: str, horizon_min: float, rows: list[SkillRow]) -> SkillRow | None:
    return next((row for row in rows if row.method == method and row.horizon_min == horizon_min), None)


def advise(results: FlightResults) -> Iterator[Advice]:
    """Yield what the answer did not learn of the INS."""
    answer = results.answer(InertialResult)
    if answer is None:
        return
    if answer.kind == "gnss_aided":
        yield Advice("Record", "the free-inertial output of the INS", PURPOSE)
    if answer.kind == "unknown":
        yield Advice("Check", "whether GNSS corrects this INS (ins_kind of the aircraft file)", PURPOSE)
    if is_start_unknown(answer):
        yield Advice("Check", "when the INS began to navigate (nav_start_utc of the aircraft file)", PURPOSE)
