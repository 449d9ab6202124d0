"""Chapter on heading correction (system 1).

Gates, estimates and the figures of the published method (Markelov 2015).
"""

from collections.abc import Mapping, Sequence

from groundstation.chapters.agreement import agreement_note
from groundstation.chapters.gates import NOT_ASSESSABLE, gate_grid, setting_facts
from groundstation.chapters.parts import Facts, Figure, Grid, Head, Note, Part, Section, kept
from groundstation.chapters.wording import ABSENT, clock, interval, is_number, number, plural, step_places, typeset
from groundstation.results.chosen import ChosenInterval
from groundstation.results.flight import FlightResults
from groundstation.systems.heading.advice_chapter import explained
from groundstation.systems.heading.agreement_answer import heading_agreement
from groundstation.systems.heading.answer import (
    RAW_SPEED_LIMIT,
    HeadingResult,
    OnboardComparison,
    Standstill,
    TaxiSegment,
)
from groundstation.systems.heading.claim_chapter import PARTS, claim

SOURCES = (
    (
        "Markelov 2015",
        "Markelov, Kostishin, Shukalov: Heading correction of an INS before take-off by satellite navigation, "
        "Information and Control Systems 2015 No 6",
    ),
)
TITLE = "Heading correction"
LEAD = "On straight taxi the nose points where the aircraft moves: INS heading − GNSS track is the heading error."
WORKINGS = ("density", "convergence", "spectrum")
STANDSTILL_FIGURES = (Figure("standstill.components"), Figure("standstill.mean_speed"))
AIRCRAFT = "aircraft."  # what begins the names of settings of the aircraft file
HELD = "The receiver holds its velocity at standstill, so its error there cannot be seen."
NO_SERIAL = "no INS serial is stated (ins_serial): earlier flights of the unit cannot be found"
UNKNOWN_REASON = "the log does not hold what the method needs"
USES = {"exclude": "Left out by hand", "force": "Used by hand despite the gates"}
ESTIMATE_HEADS = (Head("Estimate"), Head("Value", True), Head("95 %", True), Head("Meaning"))
SEGMENT_HEADS = (
    *(Head("Straight taxi"), Head("Samples", True), Head("Track", True), Head("Speed", True)),
    *(Head("Error", True), Head("σ", True)),
)
ONBOARD_HEADS = (Head("Figure"), Head("Ground", True), Head("On board", True), Head("On board − ground", True))
RUNWAY_HEADS = (
    Head("Runway"),
    *(Head(title, True) for title in ("True bearing", "INS heading", "Error", "σ", "Minus taxi")),
)


def heading(results: FlightResults) -> Section:
    """Return the chapter; without an answer it says why there is none."""
    answer = results.answer(HeadingResult)
    if answer is None:
        why = next(map(explained, results.reasons("heading")), UNKNOWN_REASON)
        note = Note(f"Not assessable: {why}", "unknown")
        headline = f"{NOT_ASSESSABLE.symbol} Heading not assessable"
        return Section("heading", TITLE, LEAD, (note,), headline)
    told, segments = claim(answer), _segments(answer.segments)
    parts = (
        agreement_note(heading_agreement(results.answers)),
        _second(answer),
        gate_grid(answer.gates),
        Figure("heading.difference"),
        Figure("heading.taxi"),
        Figure("heading.forest", instead=segments),
        *(_onboard(answer), _runway(answer)),
        *_standstill(answer.standstill),
        _by_hand(results.chosen),
    )
    has_serial = bool(results.metadata.get("ins_serial") or answer.settings.get("aircraft.ins_serial"))
    workings = (
        *(
            _estimates(answer),
            _spread(answer, has_serial=has_serial),
            _geometry(answer),
            _standstill_facts(answer),
        ),
        *(Figure(f"heading.{name}") for name in WORKINGS),
        *_settings(answer.settings),
    )
    above: tuple[Part, ...] = (*(Note(sentence) for sentence in told.sentences), Facts("", told.figures))
    return Section("heading", TITLE, LEAD, kept(parts), told.line, above, told, kept(workings))


def _second(answer: HeadingResult) -> Note | None:
    """Return the second interval, by states of their own, beside that of the taxi."""
    second = answer.by_states
    if second is None:
        return None
    taxi, other = (
        f"{number(error, 3, '°', signed=True)} (95 % {interval(ends, 3, '°')})"
        for error, ends in (
            (answer.error_deg, answer.confidence95_deg),
            (second.error_deg, second.confidence95_deg),
        )
    )
    meet = "Their intervals meet" if second.agrees else "Their intervals do not meet: one errs by more than it says"
    at_once = (
        ""
        if second.correlation is None
        else f" (correlation of their differences {number(second.correlation, 2, signed=True)})"
    )
    text = (
        f"Heading error by taxi {taxi}; {second.by} on the same straights {other}, {plural(second.samples, 'epoch')}. "
        f"{meet}. Both rest on the INS heading and on GNSS velocity{at_once}, so they are not combined; agreement is "
        "weaker evidence than that of independent numbers."
    )
    return Note(typeset(text), "good" if second.agrees else "warn")


def _segments(segments: Sequence[TaxiSegment]) -> Grid | None:
    rows = [
        (
            f"{clock(one.start_s)} – {clock(one.end_s)}",
            number(one.samples, 0),
            number(one.mean_track_deg, 1, "°"),
            number(one.mean_speed_mps, 1, "m/s"),
            number(one.error_deg, 3, "°", signed=True),
            number(one.sigma_deg, 3, "°"),
        )
        for one in segments
    ]
    return Grid("Estimates by segment", SEGMENT_HEADS, rows) if rows else None


def _estimates(answer: HeadingResult) -> Grid:
    value = {
        name: number(getattr(answer, f"{name}_deg"), places, "°", signed=name.endswith("error"))
        for name, places in (("error", 4), ("paper_error", 4), ("precision", 4), ("uncorrected_error", 4))
    }
    rows = (
        (
            "Heading error, robust and weighted by speed",
            value["error"],
            interval(answer.confidence95_deg, 3, "°"),
            "the airframe's, used for the correction; interval allows for correlation and steady sideslip",
        ),
        (
            "Heading error, running mean of Markelov 2015",
            value["paper_error"],
            f"± {value['precision']} (e)",
            "e holds for white errors only",
        ),
        ("Heading error without lever arm", value["uncorrected_error"], ABSENT, ""),
        (
            "Azimuth error of the platform",
            number(answer.platform_error_deg, 4, "°", signed=True),
            interval(answer.platform_confidence95_deg, 3, "°") if answer.platform_confidence95_deg else ABSENT,
            "navigation's: mounting taken off, its sigma in the interval",
        ),
        ("Standard deviation of the differences", number(answer.estimate_sd_deg, 3, "°"), ABSENT, ""),
        ("Quality: scatter of the running mean", number(answer.quality_deg, 3, "°"), ABSENT, ""),
    )
    pair = f"INS topic {answer.ins_topic} ({answer.heading_source}) against GNSS topic {answer.gnss_topic}."
    return Grid("Estimates", ESTIMATE_HEADS, rows, pair)


def _onboard(answer: HeadingResult) -> Grid | None:
    onboard = answer.onboard
    if onboard is None:
        return None
    rows = [
        (
            "Heading error",
            number(answer.error_deg, 3, "°", signed=True),
            number(onboard.heading_error_deg, 3, "°", signed=True),
            number(onboard.difference_error_deg, 3, "°", signed=True),
        ),
        *((*figure, "") for figure in _onboard_figures(answer, onboard)),
    ]
    status = onboard.status
    caption = f"Status reported by the aircraft: {status}." if status else "The aircraft reported no status."
    return Grid("Ground result and the aircraft's own", ONBOARD_HEADS, rows, caption)


def _onboard_figures(answer: HeadingResult, onboard: OnboardComparison) -> tuple[tuple[str, str, str], ...]:
    step = step_places(answer.entry_step_deg)
    correction, entered = answer.correction_deg, onboard.correction_entered_deg
    return (
        ("Precision e", number(answer.precision_deg, 4, "°"), number(onboard.precision_deg, 4, "°")),
        ("Quality", number(answer.quality_deg, 4, "°"), number(onboard.quality_deg, 4, "°")),
        ("Cycles (distinct epochs on the ground)", number(answer.samples, 0), number(onboard.cycles, 0)),
        ("Correction", number(correction, step, "°", signed=True), number(entered, step, "°", signed=True)),
    )


def _runway(answer: HeadingResult) -> Grid | None:
    rows = [
        (
            check.name,
            number(check.true_bearing_deg, 2, "°"),
            number(check.ins_heading_deg, 2, "°"),
            number(check.error_deg, 3, "°", signed=True),
            number(check.sigma_deg, 3, "°"),
            number(check.difference_deg, 3, "°", signed=True),
        )
        for check in answer.runway
    ]
    caption = "A second reference: the nose points along the centre line."
    return Grid("Runway check", RUNWAY_HEADS, rows, caption) if rows else None


def _standstill(still: Standstill | None) -> tuple[Part, ...]:
    """Return the figures of the standstill.

    A note instead where the receiver holds its velocity: the figures would be flat lines at zero.
    """
    return (Note(HELD, "unknown"),) if still is not None and still.velocity_is_held else STANDSTILL_FIGURES


def _standstill_facts(answer: HeadingResult) -> Facts | None:
    still = answer.standstill
    if still is None or still.velocity_is_held:
        return None
    mean = f"{_velocity(still.mean_north_mps)} / {_velocity(still.mean_east_mps)}"
    sigma = f"{number(still.sigma_north_mps, 4, 'm/s')} / {number(still.sigma_east_mps, 4, 'm/s')}"
    length, bound = number(still.speed_of_mean_mps, 4, "m/s"), number(still.speed_bound97_mps, 4, "m/s")
    share = number(still.share_above_limit * 100.0, 1, "%")
    span, samples = f"{clock(still.start_s)} – {clock(still.end_s)}", plural(still.samples, "sample")
    pairs = (
        ("Interval", span, samples),
        ("Proof of standstill", still.ground_proof or ABSENT, ""),
        ("Mean velocity, north / east", mean, ""),
        ("Standard deviation, north / east", sigma, ""),
        ("Length of the mean vector", length, f"gated; 0.97 bound {bound}"),
        (
            "Mean of the speeds",
            number(still.mean_of_speed_mps, 4, "m/s"),
            "other reading of Markelov 2015; not gated",
        ),
        (f"Raw samples above {answer.setting(*RAW_SPEED_LIMIT):g} m/s", share, ""),
        ("Parts of the velocity error", _make_up(still), ""),
    )
    return Facts("GNSS at standstill", pairs)


def _velocity(value_mps: float) -> str:
    return number(value_mps, 4, "m/s", signed=True)


def _make_up(still: Standstill) -> str:
    if not is_number(still.white_sigma_mps):
        return ABSENT
    white, correlated = number(still.white_sigma_mps, 3, "m/s"), number(still.correlated_sigma_mps, 3, "m/s")
    return f"white {white}, correlated {correlated} over {number(still.correlation_time_s, 1, 's')}"


def _geometry(answer: HeadingResult) -> Facts:
    arm = _with_sigma(answer.lever_arm_m, answer.lever_arm_sigma_m, 2, "m")
    offset = _with_sigma(answer.time_offset_s, answer.time_offset_sigma_s, 3, "s")
    drift = _with_sigma(answer.drift_deg_per_h, answer.drift_sigma_deg_per_h, 2, "°/h")
    seen = "seen in the turns" if is_number(answer.time_offset_s) else "not observable"
    slope = "slope of the difference over the taxi" if is_number(answer.drift_deg_per_h) else "not measured"
    pairs = (
        ("Lever arm, antenna ahead of the main gear", arm, answer.lever_arm_origin),
        *_latency(answer),
        ("GNSS time offset", offset, seen),
        ("Azimuth drift", drift, slope),
    )
    return Facts("Lever arm, time offset, drift", pairs)


def _spread(answer: HeadingResult, *, has_serial: bool) -> Facts | None:
    """Return the sigmas behind the interval and the steps of the INS heading.

    Own error of a segment, wander, the parts that wind and steady sideslip add; None where no steady sideslip was
    assessed.
    """
    if not is_number(answer.steady_sigma_deg):
        return None
    wander = f"over {number(answer.wander_s, 0, 's')}"
    pairs = (
        ("Own error of a segment, σ", number(answer.segment_spread_deg, 3, "°"), "from the spread of the segments"),
        ("Wander of INS heading minus path, σ", number(answer.wander_spread_deg, 3, "°"), wander),
        *_of_the_wind(answer),
        ("Remaining steady sideslip, σ", number(answer.steady_sigma_deg, 3, "°"), answer.steady_origin),
        *([] if has_serial else [("Learned of the installation", "nothing", NO_SERIAL)]),
        *(
            ("Step of the INS heading", number(step.size_deg, 2, "°", signed=True), f"at {clock(step.time_s)}")
            for step in answer.steps
        ),
    )
    return Facts("Segments, minutes and steady terms", pairs)


def _of_the_wind(answer: HeadingResult) -> list[tuple[str, str, str]]:
    """Return the parts of the interval, each alone, and the sideslip of a known wind."""
    rows = [
        (f"95 % half width, {PARTS.get(one.name, one.name)} alone", number(one.half_width_deg, 3, "°"), "")
        for one in answer.interval_parts
    ]
    if answer.wind is not None:
        origin = f"{answer.wind.origin}, {answer.aircraft_class or 'class not stated'}"
        rows.append(("Sideslip by the wind, taken off", number(answer.sideslip_deg, 3, "°", signed=True), origin))
    return rows


def _with_sigma(value: float | None, sigma: float | None, places: int, unit: str) -> str:
    text = number(value, places, unit, signed=True)
    return f"{text} (σ {number(sigma, places, unit)})" if is_number(value) and is_number(sigma) else text


def _latency(answer: HeadingResult) -> list[tuple[str, str, str]]:
    """Return the latency by which GNSS was shifted before all else; empty where it was not."""
    if not is_number(answer.latency_used_s):
        return []
    value = _with_sigma(answer.latency_used_s, answer.latency_used_sigma_s, 3, "s")
    return [("GNSS latency removed", value, f"from the {answer.latency_origin}")]


def _settings(settings: Mapping[str, float | str | bool]) -> tuple[Facts | None, Facts | None]:
    """Return the settings of the settings file, and those of the aircraft file."""
    own = {name: value for name, value in settings.items() if not name.startswith(AIRCRAFT)}
    aircraft = {name.removeprefix(AIRCRAFT): value for name, value in settings.items() if name.startswith(AIRCRAFT)}
    return setting_facts(own, "heading"), setting_facts(aircraft, "aircraft")


def _by_hand(chosen: Sequence[ChosenInterval]) -> Facts | None:
    pairs = [(USES[one.use], f"{one.start} – {one.end}", one.reason) for one in chosen]
    return Facts("Intervals chosen by hand", pairs) if pairs else None
