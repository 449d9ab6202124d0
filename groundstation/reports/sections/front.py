"""The top of the report: which flight this is, and the verdict with the number to type."""

from collections.abc import Mapping
from typing import Any

from groundstation.chapters.parts import Front, Mark, Tone
from groundstation.chapters.wording import ABSENT, clock, interval, is_number, number, step_places, typeset
from groundstation.reports.sections.saved import heading_of, mapping, not_assessable_reason, objects
from groundstation.results.files import SavedFlight

PUBLISHED_LIMIT_ARCMIN = 20.0
FORECAST_MIN = 60.0  # the horizon the forecast is judged by at a glance

STATUS: dict[str, Mark] = {
    "ok": Mark("good", "ok"),
    "degraded": Mark("warn", "degraded: data were lost or a finding is grave"),
    "failed": Mark("bad", "failed: nothing could be computed"),
}
VERDICTS: dict[str, tuple[Tone, str]] = {
    "accept": ("good", "Accept"),
    "reject": ("bad", "Reject"),
    "extend": ("warn", "Extend"),
    "undecided": ("unknown", "Undecided"),
}
ADVICE = {
    "reject": "Enter no correction",
    "extend": "No correction yet: measure longer",
    "undecided": "No correction: a required gate was not measured",
}


def build(saved: SavedFlight) -> Front:
    """Put the top of the report together."""
    flight = mapping(saved.summary, "flight")
    heading = heading_of(saved)
    start = flight.get("start_utc")
    names = [str(flight.get(key) or "") for key in ("aircraft", "flight")]
    status = STATUS.get(str(saved.summary.get("status")), Mark("unknown", str(saved.summary.get("status"))))
    counts = [str(item.get("severity")) for item in objects(saved.summary, "findings")]
    found = " · ".join(f"{counts.count(name)} {name}" for name in ("fail", "warn", "info") if name in counts) or "none"
    pairs = (
        ("Aircraft", names[0] or "not named in the log"),
        ("Flight", names[1] or "not named in the log"),
        ("Start", f"{str(start)[:10]} {str(start)[11:19]} UTC" if start else "no absolute time"),
        ("Duration", f"{clock(flight.get('duration_s'))} {'h:min:s' if _hours(flight) else 'min:s'}"),
        ("Status", status),
        ("Findings", found),
        ("Log", str(mapping(flight, "source").get("name") or ABSENT)),
    )
    title = " · ".join(filter(None, (names[0], names[1] and f"flight {names[1]}"))) or str(flight.get("id", ""))
    if not heading:
        reason = not_assessable_reason(saved, "heading") or "the log does not hold what the method needs"
        return Front(
            title,
            pairs,
            verdict=Mark("unknown", "Not assessable"),
            headline="Heading correction: not assessable",
            sentences=(_sentence(reason),),
            figures=(*_of_the_ins(saved), *_of_the_compass(saved)),
        )
    tone, word = VERDICTS.get(str(heading.get("verdict")), ("unknown", str(heading.get("verdict"))))
    return Front(
        title,
        pairs,
        verdict=Mark(tone, word),
        headline=_headline(heading),
        sentences=tuple(
            filter(None, (_sentence(typeset(str(heading.get("verdict_reason") or ""))), _in_words(heading)))
        ),
        figures=(*_figures(heading), *_of_the_ins(saved), *_of_the_compass(saved)),
        to_sign=heading.get("verdict") == "accept",
    )


def _hours(flight: Mapping[str, Any]) -> bool:
    return is_number(flight.get("duration_s")) and flight["duration_s"] >= 3599.5


def _sentence(text: str) -> str:
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if not text or text[-1] in ".!?" else ".")


def _headline(heading: Mapping[str, Any]) -> str:
    verdict = heading.get("verdict")
    if verdict != "accept":
        return ADVICE.get(str(verdict), "Enter no correction")
    step, correction = heading.get("entry_step_deg"), heading.get("correction_deg")
    if is_number(correction) and correction:
        return f"Enter {number(correction, step_places(step), '°', signed=True)}"
    return f"Nothing to enter: the error is below half the entry step of {number(step, step_places(step), '°')}"


def _in_words(heading: Mapping[str, Any]) -> str:
    error = heading.get("error_deg")
    if not is_number(error):
        return "The heading error could not be estimated."
    if round(error, 2) == 0:
        return "INS heading agrees with the GNSS track within 0.01°."
    sense = "high" if error > 0 else "low"
    text = f"INS heading reads too {sense} by {number(abs(error), 2, '°')}"
    if heading.get("verdict") == "accept":
        step = heading.get("entry_step_deg")
        return f"{text}; entry step {number(step, step_places(step), '°')}."
    return f"{text}: an estimate, not to be entered."


def _figures(heading: Mapping[str, Any]) -> tuple[tuple[str, str, str], ...]:
    error, residual = heading.get("error_deg"), heading.get("reference_residual_arcmin")
    samples, taxi = number(heading.get("samples"), 0), number(heading.get("taxi_seconds"), 0, "s")
    figures = [
        (
            "Heading error",
            number(error, 3, "°", signed=True),
            f"95 % interval {interval(heading.get('confidence95_deg'), 3, '°')}",
        ),
        (
            "Precision e",
            number(heading.get("precision_deg"), 3, "°"),
            f"{samples} samples, {taxi} of straight taxi",
        ),
        (
            "Parking heading, corrected",
            number(heading.get("parking_heading_deg"), 2, "°"),
            f"INS showed {number(heading.get('parking_ins_heading_deg'), 2, '°')}; "
            f"σ {number(heading.get('parking_sigma_deg'), 2, '°')}",
        ),
    ]
    if is_number(residual):
        reference = number(heading.get("reference_parking_heading_deg"), 2, "°")
        figures.append(
            (
                "Against the reference",
                number(residual, 1, "′", signed=True),
                f"reference {reference}; published runs stayed within {PUBLISHED_LIMIT_ARCMIN:.0f}′",
            )
        )
    else:
        figures.append(("Against the reference", ABSENT, "no reference heading in log or site file"))
    return tuple(figures)


def _of_the_ins(saved: SavedFlight) -> tuple[tuple[str, str, str], ...]:
    """Drift of the INS and error of the forecast after an hour; nothing where they say nothing."""
    inertial, forecast = (mapping(saved.summary, "results", name) for name in ("inertial", "forecast"))
    if inertial.get("kind") != "unaided":
        return ()
    rates = [inertial.get(f"radial_error_rate_{share}_nmiph") for share in (50, 95)]
    figures = []
    if is_number(rates[0]):
        remark = f"median of the radial error; 95 % below {number(rates[1], 2, 'nmi/h')}"
        figures.append(("INS drift", number(rates[0], 2, "nmi/h"), remark))
    errors = {
        row.get("method"): row.get("rms_m")
        for row in objects(forecast, "skill")
        if row.get("horizon_min") == FORECAST_MIN
    }
    shipped = errors.get(forecast.get("default_method"))
    if is_number(shipped):
        remark = f"RMS; raw INS {number(errors.get('raw_ins'), 0, 'm')}"
        figures.append((f"Forecast, {FORECAST_MIN:g} min", number(shipped, 0, "m"), remark))
    return tuple(figures)


def _of_the_compass(saved: SavedFlight) -> tuple[tuple[str, str, str], ...]:
    """What the deviation found in flight leaves of the error of the magnetic heading."""
    magnetic = mapping(saved.summary, "results", "magnetic")
    residual = mapping(magnetic, "residual_rms_deg")
    if not is_number(residual.get("after")):
        return ()
    before = number(residual.get("before"), 2, "°")
    remark = f"RMS after correction; {before} before; deviation {magnetic.get('verdict')}"
    return (("Magnetic heading", number(residual.get("after"), 2, "°"), remark),)
