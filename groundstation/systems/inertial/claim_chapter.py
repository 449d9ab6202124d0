"""Claims of the INS errors and of the forecast, and what to record and check for them.

How fast the INS drifts, and how far a forecast can go.
"""

from collections.abc import Iterator

from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.chapters.chapter import Advice
from groundstation.chapters.parts import Claim, Mark, Rank, Tone
from groundstation.chapters.wording import ABSENT, clock, is_number, number, typeset
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.drift_answer import (
    growth_nmiph,
    is_start_stated,
    is_start_unknown,
    judged_outage,
)
from groundstation.systems.inertial.forecast_answer import ForecastResult

MEASURED, DOUBTFUL, NO_RATE = Mark("good", "Measured"), Mark("warn", "Doubtful"), Mark("unknown", "No rate")
PURPOSE = "INS errors"


def inertial_claim(answer: InertialResult, quality: str, *, is_doubtful: bool) -> Claim:
    """Return the drift of an INS that GNSS does not correct.

    ``quality`` says in a sentence whether the filter can be trusted; ``is_doubtful`` that its sigmas are too small.
    Without a rate nothing is judged: the claim is open.
    """
    rate, measure = drift_of(answer)
    drift = number(rate, 2, "nmi/h")
    sentences = (quality,) if quality else ()
    mark = NO_RATE
    if is_number(rate):
        headline = f"Unaided INS, drifts {drift}"
        start = answer.navigation_start
        remark = measure
        if start is not None and is_start_stated(answer):
            remark = f"{measure}; start of navigation as stated: {start.reason}"
        mark = DOUBTFUL if is_doubtful else MEASURED
    elif is_start_unknown(answer):
        headline = growth_headline(answer)
        remark = "no rate: nothing shows when navigation began"
        sentences = (why_no_rate(answer), *sentences)
    else:
        headline, remark = "INS errors measured, flight too short for a drift", ""
    found = (
        ("INS drift", drift, remark),
        ("Velocity error", number(answer.velocity_error_rms_mps, 2, "m/s"), "RMS"),
        ("Largest position error", *largest_of(answer)),
    )
    return Claim(
        Rank.INERTIAL,
        mark,
        headline,
        value=drift if is_number(rate) else "",
        remark=remark,
        sentences=sentences,
        figures=tuple(figure for figure in found if figure[1] != ABSENT),
    )


def growth_headline(answer: InertialResult) -> str:
    """Return how the position error grew, where no start of navigation is known."""
    rate = growth_nmiph(answer)
    if rate is None:
        return "INS errors measured, start of navigation not known"
    verb = "grew" if rate >= 0.0 else "fell"
    return f"INS error {verb} at {number(abs(rate), 2, 'nmi/h')} within the log"


def why_no_rate(answer: InertialResult) -> str:
    """Return why that growth is no drift rate, and what to state for one."""
    start = answer.navigation_start
    reason = "" if start is None else f" ({typeset(start.reason)})"
    return (
        f"No drift rate: position error {growth(answer)}; nothing shows when navigation began{reason}. For a rate "
        "state nav_start_utc, in the aircraft file or in the head of the log."
    )


def largest_of(answer: InertialResult) -> tuple[str, str]:
    """Return the largest position error, and against what and when, in nautical miles too."""
    value = answer.largest_radial_error_m
    if not is_number(value):
        return ABSENT, ""
    at, utc = answer.largest_radial_error_at_s, answer.largest_radial_error_utc
    miles = number(value / M_PER_NAUTICAL_MILE, 2, "nmi")
    when = f", at {clock(at)}" if is_number(at) else ""
    in_utc = f" ({utc[:10]} {utc[11:19]} UTC)" if utc else ""
    return number(value, 0, "m"), f"{miles}, against GNSS{when}{in_utc}"


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


def growth(answer: InertialResult) -> str:
    """Return the position error at the ends of the log, and the time between them, in words."""
    minutes = None if answer.compared_hours is None else 60.0 * answer.compared_hours
    first, last = (number(error, 0, "m") for error in (answer.radial_error_first_m, answer.radial_error_last_m))
    return f"{first} at first, {last} after {number(minutes, 0, 'min')}"


def forecast_claim(answer: ForecastResult, sentences: tuple[str, ...], tone: Tone) -> Claim | None:
    """Return what 95 % of the errors stay within after an hour; None without an error.

    The raw INS stands beside the default method: the difference is what the estimator buys. The horizon is the longest
    up to an hour, or the shortest where all are longer.
    """
    found = judged_outage(answer)
    if found is None:
        return None
    ours, raw = found
    lead, value = f"{ours.horizon_min:g} min", number(ours.p95_m, 0, "m")
    against = "" if raw is None else f"; raw INS {number(raw.p95_m, 0, 'm')}"
    return Claim(
        Rank.FORECAST,
        DOUBTFUL if tone == "warn" else MEASURED,
        f"Forecast: 95 % within {value} after {lead} without GNSS{against}",
        value,
        f"95 % after {lead} without GNSS, corrected{against}",
        sentences,
        ((f"Forecast, {lead}", value, f"95 %{against}"),),
    )


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
