"""The top of the report: which flight this is, and the verdict with the number to type."""

from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.assessed import reason_of
from groundstation.chapters.cooperative import is_session, session_front
from groundstation.chapters.parts import Cell, Front, Mark
from groundstation.chapters.plan import is_plan, plan_front
from groundstation.chapters.verdict import NOT_ASSESSABLE, VERDICTS, figures, reasons, sentence, what_to_enter
from groundstation.chapters.wording import ABSENT, clock, is_number, number
from groundstation.results.flight import FlightResults, Status
from groundstation.results.forecast import ForecastResult
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.magnetic import MagneticResult

FORECAST_MIN = 60.0  # the horizon the forecast is judged by at a glance
HOUR_S = 3599.5  # rounds to an hour
STATUS: dict[Status, Mark] = {
    "ok": Mark("good", "ok"),
    "degraded": Mark("warn", "degraded: data were lost"),
    "failed": Mark("bad", "failed: nothing could be computed"),
}
UNKNOWN_REASON = "the log does not hold what the method needs"


def front(results: FlightResults) -> Front:
    """The top of the report."""
    if is_plan(results):
        return plan_front(results, _pairs_of_plan(results))
    names = [results.metadata.get(key, "") for key in ("aircraft", "flight")]
    title = " · ".join(filter(None, (names[0], names[1] and f"flight {names[1]}"))) or results.flight_id
    if is_session(results):
        return session_front(results, _pairs(results, names))
    pairs, of_the_rest = _pairs(results, names), (*_of_the_ins(results), *_of_the_compass(results))
    heading = results.answer(HeadingResult)
    if heading is None:
        why = (sentence(reason_of(results, "heading") or UNKNOWN_REASON),)
        return Front(title, pairs, NOT_ASSESSABLE, "Heading correction: not assessable", why, of_the_rest)
    return Front(
        title,
        pairs,
        verdict=VERDICTS[heading.verdict],
        headline=what_to_enter(heading),
        sentences=reasons(heading),
        figures=(*figures(heading), *of_the_rest),
        to_sign=heading.verdict == "accept",
    )


def _pairs(results: FlightResults, names: list[str]) -> tuple[tuple[str, Cell], ...]:
    start = "" if results.start_utc_ns is None else utc_ns_to_iso(results.start_utc_ns)
    return (
        ("Aircraft", names[0] or "not named in the log"),
        ("Flight", names[1] or "not named in the log"),
        ("Start", f"{start[:10]} {start[11:19]} UTC" if start else "no absolute time"),
        _duration(results),
        ("Status", STATUS[results.status]),
        ("Findings", _counts(results)),
        ("Log", results.source.name or ABSENT),
    )


def _pairs_of_plan(results: FlightResults) -> tuple[tuple[str, Cell], ...]:
    scenario = ("Scenario", results.source.name or ABSENT)
    return (
        ("Plan", results.metadata.get("plan", "") or ABSENT),
        _duration(results),
        ("Findings", _counts(results)),
        scenario,
    )


def _duration(results: FlightResults) -> tuple[str, str]:
    has_hours = is_number(results.duration_s) and results.duration_s >= HOUR_S
    return "Duration", f"{clock(results.duration_s)} {'h:min:s' if has_hours else 'min:s'}"


def _counts(results: FlightResults) -> str:
    counts = [finding.severity for finding in results.findings]
    return " · ".join(f"{counts.count(name)} {name}" for name in ("fail", "warn", "info") if name in counts) or "none"


def _of_the_ins(results: FlightResults) -> tuple[tuple[str, str, str], ...]:
    """Drift of the INS and error of the forecast after an hour; nothing where they say nothing."""
    inertial, forecast = results.answer(InertialResult), results.answer(ForecastResult)
    if inertial is None or inertial.kind != "unaided":
        return ()
    figures = []
    if is_number(inertial.radial_error_rate_50_nmiph):
        rate, most = inertial.radial_error_rate_50_nmiph, number(inertial.radial_error_rate_95_nmiph, 2, "nmi/h")
        figures.append(("INS drift", number(rate, 2, "nmi/h"), f"median of the radial error; 95 % below {most}"))
    rows = () if forecast is None else forecast.skill
    errors = {row.method: row.rms_m for row in rows if row.horizon_min == FORECAST_MIN}
    shipped = None if forecast is None else errors.get(forecast.default_method)
    if is_number(shipped):
        remark = f"RMS; raw INS {number(errors.get('raw_ins'), 0, 'm')}"
        figures.append((f"Forecast, {FORECAST_MIN:g} min", number(shipped, 0, "m"), remark))
    return tuple(figures)


def _of_the_compass(results: FlightResults) -> tuple[tuple[str, str, str], ...]:
    """What the deviation found in flight leaves of the error of the magnetic heading."""
    magnetic = results.answer(MagneticResult)
    residual = None if magnetic is None else magnetic.residual_rms_deg
    if magnetic is None or residual is None or not is_number(residual.after):
        return ()
    before = number(residual.before, 2, "°")
    remark = f"RMS after correction; {before} before; deviation {magnetic.verdict}"
    return (("Magnetic heading", number(residual.after, 2, "°"), remark),)
