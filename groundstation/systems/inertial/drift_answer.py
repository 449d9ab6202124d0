"""Drift of an INS as line and page tell it: rate, growth within the log, largest error."""

from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import M_PER_NAUTICAL_MILE, NS_PER_S
from groundstation.base.words import clock_text
from groundstation.results.answer import Answers, answer_of
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.forecast_answer import ForecastResult, SkillRow

HOUR_MIN = 60.0  # the horizon a forecast is judged by at a glance, or the longest below it


def utc_of(start_utc_ns: int | None, time_s: float | None) -> str:
    """Return UTC of a flight time to the second; empty without either.

    Examples
    --------
    >>> utc_of(1_401_652_872_000_000_000, 17_989.0), utc_of(None, 1.0)
    ('2014-06-02T01:01:01Z', '')
    """
    if start_utc_ns is None or time_s is None:
        return ""
    return utc_ns_to_iso(start_utc_ns + round(time_s * NS_PER_S), 0)


def is_start_unknown(answer: InertialResult) -> bool:
    """Tell whether the start of navigation is unknown.

    False for answers of older versions, which did not look for it.
    """
    return answer.navigation_start is not None and answer.navigation_start.time_s is None


def is_start_stated(answer: InertialResult) -> bool:
    """Tell whether somebody stated the start of navigation that the rate counts from."""
    return answer.navigation_start is not None and answer.navigation_start.basis == "stated"


def growth_nmiph(answer: InertialResult) -> float | None:
    """Return how fast the position error grew from the first to the last comparison, nmi/h.

    It is no drift rate of the INS: what the error was before the log is not known. Negative where it shrank.
    """
    first, last, hours = answer.radial_error_first_m, answer.radial_error_last_m, answer.compared_hours
    if first is None or last is None or not hours:
        return None
    return (last - first) / M_PER_NAUTICAL_MILE / hours


def judged_outage(answer: ForecastResult) -> tuple[SkillRow, SkillRow | None] | None:
    """Return the rows of the default method and of the raw INS a forecast is judged by.

    They are those of an hour, of the longest horizon below it, or of the shortest where all are longer.
    """
    rows = {(row.method, row.horizon_min): row for row in answer.skill}
    leads = sorted(lead for method, lead in rows if method == answer.default_method)
    if not leads:
        return None
    lead = max((one for one in leads if one <= HOUR_MIN), default=leads[0])
    return rows[answer.default_method, lead], rows.get(("raw_ins", lead))


def sentence(answers: Answers) -> str:
    """Return the line on an INS that GNSS does not correct: drift, largest error, forecast."""
    inertial, forecast = answer_of(answers, InertialResult), answer_of(answers, ForecastResult)
    if inertial is None:
        return ""
    told = ", ".join(filter(None, (_drift(inertial), _largest(inertial))))
    ahead = "" if forecast is None else _ahead(forecast)
    return "; ".join(filter(None, (told or "INS errors estimated", ahead)))


def _drift(inertial: InertialResult) -> str:
    rate = inertial.radial_error_rate_fit_nmiph
    if rate is not None:
        return f"INS {rate:.2f} nmi/h{_stated(inertial)}"
    if not is_start_unknown(inertial):
        return ""
    growth, state = growth_nmiph(inertial), " (state nav_start_utc)"
    if growth is None:
        return f"no rate: start of navigation not known{state}"
    verb = "grew" if growth >= 0.0 else "fell"
    return f"no rate: INS error {verb} {abs(growth):.2f} nmi/h in log{state}"


def _stated(inertial: InertialResult) -> str:
    """Return since when the rate counts, where somebody stated it."""
    start = inertial.navigation_start
    if start is None or not is_start_stated(inertial):
        return ""
    who, _, when = start.reason.rpartition(" says ")
    return f" since {when} as stated" + (f" ({who})" if who else "")


def _largest(inertial: InertialResult) -> str:
    """Return the largest position error and when it was, UTC where the flight has it."""
    value, at = inertial.largest_radial_error_m, inertial.largest_radial_error_at_s
    if value is None or at is None:
        return ""
    utc = inertial.largest_radial_error_utc
    when = f"{utc[11:19]} UTC" if utc else clock_text(at)
    return f"max {value / M_PER_NAUTICAL_MILE:.2f} nmi at {when}"


def _ahead(forecast: ForecastResult) -> str:
    found = judged_outage(forecast)
    if found is None:
        return ""
    ours, raw = found
    without = "" if raw is None else f" (raw INS {raw.p95_m:.0f} m)"
    return f"95 % forecast {ours.p95_m:.0f} m at {ours.horizon_min:g} min{without}"
