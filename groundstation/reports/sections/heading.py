"""Chapter: heading correction (system 1): gates, estimates and the figures of the published method."""

from collections.abc import Mapping
from typing import Any

from groundstation.chapters.parts import Cell, Facts, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import (
    ABSENT,
    any_value,
    clock,
    interval,
    is_number,
    named_quantity,
    number,
    number_with_unit,
    significant,
    step_places,
    typeset,
    unit_sign,
)
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures import heading as heading_figures
from groundstation.reports.figures import standstill as standstill_figures
from groundstation.reports.sections.saved import heading_of, mapping, not_assessable_reason, objects
from groundstation.results.files import SavedFlight

SENSE_SIGNS = {"at_most": "≤ ", "at_least": "≥ "}
GATE_MARKS = {
    "passed": Mark("good", "passed"),
    "failed": Mark("bad", "failed"),
    "not_measured": Mark("unknown", "not measured"),
}


def build(saved: SavedFlight) -> Section:
    """Build the chapter; without a result it says why there is none."""
    heading = heading_of(saved)
    lead = (
        "On straight taxi the nose points where the aircraft moves: the mean of INS heading minus GNSS track is the "
        "heading error. Error = INS heading − true heading; the correction is its negative."
    )
    if not heading:
        reason = not_assessable_reason(saved, "heading") or "the log does not hold what the method needs"
        note = Note(f"Not assessable: {reason}", "unknown")
        return Section("heading", "Heading correction", lead, (note, *_figures(saved), *_standstill_figures(saved)))
    parts = (
        *(gate_grid(heading), _estimates(heading)),
        *_figures(saved),
        *(_onboard(heading), _runway(heading), _geometry(heading), _standstill(heading)),
        *_standstill_figures(saved),
        *(_by_hand(saved), setting_facts(heading)),
    )
    return Section("heading", "Heading correction", lead, tuple(part for part in parts if part is not None))


def _figures(saved: SavedFlight) -> tuple[Part, ...]:
    return _drawn(
        heading_figures.difference(saved),
        heading_figures.density(saved),
        heading_figures.convergence(saved),
        heading_figures.taxi(saved),
        heading_figures.forest(saved),
        heading_figures.spectrum(saved),
    )


def _standstill_figures(saved: SavedFlight) -> tuple[Part, ...]:
    return _drawn(standstill_figures.components(saved), standstill_figures.mean_speed(saved))


def _drawn(*drawings: Drawing | None) -> tuple[Part, ...]:
    return tuple(drawing for drawing in drawings if drawing is not None)


def limit_text(gate: Mapping[str, Any]) -> str:
    """A gate's limit with its sense.

    Examples
    --------
    >>> limit_text({"limit": 0.05, "unit": "deg", "sense": "at_most"})
    '≤ 0.05°'
    >>> limit_text({"limit": 20.0, "unit": "s", "sense": "at_least"})
    '≥ 20\u202fs'
    >>> limit_text({"limit": [-1.2, 2.0], "unit": "", "sense": "between"})
    '−1.2 … 2'
    """
    limit, unit = gate.get("limit"), unit_sign(str(gate.get("unit", "")))
    if isinstance(limit, list | tuple) and len(limit) == 2:
        return number_with_unit(f"{significant(limit[0], 4)} … {significant(limit[1], 4)}", unit)
    text = number_with_unit(significant(limit, 4), unit)
    return SENSE_SIGNS.get(str(gate.get("sense")), "") + text


def gate_grid(answer: Mapping[str, Any]) -> Grid | None:
    """The gates of an answer, each with figure, limit and reason; None where there are none."""
    rows: list[tuple[Cell, ...]] = []
    for gate in objects(answer, "gates"):
        unit = unit_sign(str(gate.get("unit", "")))
        role = "decides" if gate.get("required") else "informs"
        state = GATE_MARKS.get(str(gate.get("state")), Mark("unknown", str(gate.get("state"))))
        if state.tone == "bad" and not gate.get("required"):
            state = Mark("warn", state.text)  # it does not stand against an accepted answer
        value = number_with_unit(significant(gate.get("value"), 3), unit)
        title = str(gate.get("title") or gate.get("name") or "")
        title, reason = title[:1].upper() + title[1:], typeset(str(gate.get("reason") or ""))
        rows.append((state, title, value, limit_text(gate), role, reason))
    heads = (Head("State"), Head("Gate"), Head("Figure", True), Head("Limit", True), Head("Role"), Head("Reason"))
    caption = "Accept asks for every gate that decides; one that could not be measured is neither passed nor failed."
    return Grid("Gates", heads, rows, caption) if rows else None


def _estimates(heading: Mapping[str, Any]) -> Grid:
    rows = (
        (
            "Heading error, robust and weighted by speed",
            number(heading.get("error_deg"), 4, "°", signed=True),
            interval(heading.get("confidence95_deg"), 3, "°"),
            "the estimate corrected by; its interval allows for errors correlated over seconds",
        ),
        (
            "Heading error, running mean of the paper",
            number(heading.get("paper_error_deg"), 4, "°", signed=True),
            f"± {number(heading.get('precision_deg'), 4, '°')} (e)",
            "e is right for white errors only: it is not the accuracy",
        ),
        (
            "Heading error, antenna velocity as logged",
            number(heading.get("uncorrected_error_deg"), 4, "°", signed=True),
            ABSENT,
            "what a computer on board would find without correcting for the lever arm",
        ),
        (
            "Standard deviation of the differences",
            number(heading.get("estimate_sd_deg"), 3, "°"),
            ABSENT,
            "sway, GNSS noise and what the airframe adds",
        ),
        (
            "Quality: scatter of the running mean",
            number(heading.get("quality_deg"), 3, "°"),
            ABSENT,
            "convergence, and gross drift in azimuth",
        ),
    )
    heads = (Head("Estimate"), Head("Value", True), Head("95 %", True), Head("Meaning"))
    ins, gnss = heading.get("ins_topic"), heading.get("gnss_topic")
    pair = f"INS topic {ins} ({heading.get('heading_source')}) against GNSS topic {gnss}."
    return Grid("Estimates", heads, rows, pair)


def _onboard(heading: Mapping[str, Any]) -> Grid | None:
    onboard = mapping(heading, "onboard")
    if not onboard:
        return None
    step = step_places(heading.get("entry_step_deg"))
    quantities = (
        ("Heading error", "error_deg", "heading_error_deg", 3, "°", True),
        ("Precision e", "precision_deg", "precision_deg", 4, "°", False),
        ("Quality", "quality_deg", "quality_deg", 4, "°", False),
        ("Cycles (distinct epochs on the ground)", "samples", "cycles", 0, "", False),
        ("Correction", "correction_deg", "correction_entered_deg", step, "°", True),
    )
    rows = [
        (
            title,
            number(heading.get(ours), places, unit, signed),
            number(onboard.get(theirs), places, unit, signed),
            number(onboard.get("difference_error_deg"), 3, "°", True) if ours == "error_deg" else "",
        )
        for title, ours, theirs, places, unit, signed in quantities
    ]
    heads = (Head("Figure"), Head("Ground", True), Head("On board", True), Head("On board − ground", True))
    status = onboard.get("status")
    caption = f"Status reported by the aircraft: {status}." if status else "The aircraft reported no status."
    return Grid("Ground result beside the aircraft's own", heads, rows, caption)


def _runway(heading: Mapping[str, Any]) -> Grid | None:
    rows = [
        (
            str(check.get("name", "")),
            number(check.get("true_bearing_deg"), 2, "°"),
            number(check.get("ins_heading_deg"), 2, "°"),
            number(check.get("error_deg"), 3, "°", signed=True),
            number(check.get("sigma_deg"), 3, "°"),
            number(check.get("difference_deg"), 3, "°", signed=True),
        )
        for check in objects(heading, "runway")
    ]
    heads = (
        Head("Runway"),
        *(Head(title, True) for title in ("True bearing", "INS heading", "Error", "σ", "Minus taxi")),
    )
    return Grid("Runway check", heads, rows, "A second reference: the nose on the centre line.") if rows else None


def _standstill(heading: Mapping[str, Any]) -> Facts | None:
    still = mapping(heading, "standstill")
    if not still:
        return None
    mean = [number(still.get(f"mean_{axis}_mps"), 4, "m/s", signed=True) for axis in ("north", "east")]
    sigma = [number(still.get(f"sigma_{axis}_mps"), 4, "m/s") for axis in ("north", "east")]
    white, correlated = (number(still.get(f"{kind}_sigma_mps"), 3, "m/s") for kind in ("white", "correlated"))
    make_up = f"white {white}, correlated {correlated} over {number(still.get('correlation_time_s'), 1, 's')}"
    pairs = (
        (
            "Interval",
            f"{clock(still.get('start_s'))} – {clock(still.get('end_s'))}",
            f"{number(still.get('samples'), 0)} samples",
        ),
        ("Proof of standstill", str(still.get("ground_proof") or ABSENT), ""),
        ("Mean velocity, north / east", " / ".join(mean), ""),
        ("Standard deviation, north / east", " / ".join(sigma), ""),
        (
            "Length of the mean vector",
            number(still.get("speed_of_mean_mps"), 4, "m/s"),
            f"gated; 0.97 bound {number(still.get('speed_bound97_mps'), 4, 'm/s')}",
        ),
        (
            "Mean of the speeds",
            number(still.get("mean_of_speed_mps"), 4, "m/s"),
            "the paper's other reading; not gated",
        ),
        ("Raw samples above 0.2 m/s", _percent(still.get("share_above_limit")), ""),
        ("Make-up of the velocity error", make_up if is_number(still.get("white_sigma_mps")) else ABSENT, ""),
    )
    return Facts("GNSS at standstill", pairs)


def _percent(share: Any) -> str:
    return number(share * 100.0, 1, "%") if is_number(share) else ABSENT


def _with_sigma(value: Any, sigma: Any, places: int, unit: str) -> str:
    text = number(value, places, unit, signed=True)
    return f"{text} (σ {number(sigma, places, unit)})" if is_number(value) and is_number(sigma) else text


def _geometry(heading: Mapping[str, Any]) -> Facts:
    pairs = (
        (
            "Lever arm, antenna ahead of the main gear",
            _with_sigma(heading.get("lever_arm_m"), heading.get("lever_arm_sigma_m"), 2, "m"),
            str(heading.get("lever_arm_origin") or ""),
        ),
        *_latency(heading),
        (
            "GNSS time offset",
            _with_sigma(heading.get("time_offset_s"), heading.get("time_offset_sigma_s"), 3, "s"),
            "seen in the turns" if is_number(heading.get("time_offset_s")) else "not observable",
        ),
        (
            "Azimuth drift",
            _with_sigma(heading.get("drift_deg_per_h"), heading.get("drift_sigma_deg_per_h"), 2, "°/h"),
            "slope of the difference over the taxi" if is_number(heading.get("drift_deg_per_h")) else "not measured",
        ),
    )
    return Facts("Lever arm, time offset, drift", pairs)


def _latency(heading: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The latency by which GNSS was put back before all else; nothing where it was not."""
    if not is_number(heading.get("latency_used_s")):
        return []
    value = _with_sigma(heading.get("latency_used_s"), heading.get("latency_used_sigma_s"), 3, "s")
    return [("GNSS latency taken out", value, f"from the {heading.get('latency_origin')}")]


def _by_hand(saved: SavedFlight) -> Facts | None:
    configuration = saved.manifest.configuration
    titles = (("exclude", "Left out by hand"), ("force", "Used by hand against the gates"))
    pairs = [
        (title, f"{span.get('from')} – {span.get('to')}", str(span.get("reason") or ""))
        for key, title in titles
        for span in objects(configuration, key)
    ]
    return Facts("Intervals chosen by hand", pairs) if pairs else None


def setting_facts(answer: Mapping[str, Any]) -> Facts | None:
    """The settings an answer was found with."""
    pairs = []
    for name, value in sorted(mapping(answer, "settings").items()):
        title, unit = named_quantity(str(name))
        pairs.append((title, any_value(value, unit), ""))
    return Facts("Settings of the method", pairs, compact=True) if pairs else None
