"""Chapter on the errors of an unaided INS by cause: shares, Schuler, body axes, legs."""

from groundstation.base.words import capitalised
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Cell, Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, clock, number, typeset, unit_sign
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.cause_answer import (
    CauseParameter,
    CauseShare,
    CausesResult,
    ErrorWindow,
    SchulerWave,
    StraightLeg,
    Within95,
    taken_away,
)
from groundstation.systems.inertial.claim_chapter import lead_of
from groundstation.systems.inertial.units_answer import Measured

TITLE = "INS errors by cause"
LEAD = (
    "Constants of the INS fitted over the whole flight, under the random drift of its class. Error = INS − truth; "
    "± and ranges are 95 %."
)
PLACES = {"dph": 4, "ug": 0, "arcsec": 1, "deg": 3}
SIGNS = {"ug": "µg"}
HALF = 0.5
WORDS = {
    "schuler": "Schuler from the start",
    "drift": "constant drift",
    "azimuth": "azimuth in turns",
    "body": "turns with the aircraft",
    "reset": "resets",
    "unexplained": "unexplained",
}
CAUSES: dict[str, tuple[str, str]] = {
    "schuler": ("Schuler oscillation from the start", "velocity error and tilt at the start"),
    "drift": ("Constant drift, north and east", "gyros and azimuth together, mean over the flight"),
    "azimuth": ("Azimuth error in turns", "what an azimuth error does beside a constant drift"),
    "body": ("Fixed to the aircraft, turned with it", "accelerometer biases and gyro drifts, from the first turn on"),
    "reset": ("Jumps at resets", ""),
    "unexplained": ("Unexplained by constants", "random drift, random walk, gravity, noise of GNSS"),
}


def causes(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(CausesResult)
    if answer is None:
        return without_answer(results, "ins_causes", TITLE, LEAD)
    parts: tuple[Part | None, ...] = (
        Note(f"{typeset(answer.sentence)}."),
        _one_heading(answer),
        _shares(answer),
        Figure("causes.velocity"),
        _schuler(answer),
        _parameters(answer),
        _legs(answer),
        Figure("causes.along"),
        _windows(answer),
    )
    headline = f"{CAUSES[_top(answer).name][0]}: {number(100.0 * _top(answer).share.value, 0, '%')}{_away(answer)}"
    return Section(
        "ins_causes",
        TITLE,
        lead_of(LEAD, answer.ins_topic, results),
        kept(parts),
        headline,
        claim=_claim(answer, headline),
        appendix=kept((_facts(answer),)),
    )


def _top(answer: CausesResult) -> CauseShare:
    return max(answer.shares, key=lambda one: one.share.value)


def _claim(answer: CausesResult, headline: str) -> Claim:
    """Return the claim: good where one cause surely has half of the error."""
    share = _top(answer).share
    mark = Mark("good", "Measured") if share.low95 > HALF else Mark("unknown", "Undecided")
    value = number(100.0 * share.value, 0, "%")
    remark = f"{WORDS[_top(answer).name]}{_away(answer)}"
    return Claim(Rank.FORECAST, mark, headline, value, remark, (f"{typeset(answer.sentence)}.",))


def _away(answer: CausesResult) -> str:
    """Return behind a comma what cancels of a largest share above 100 %."""
    away = taken_away(_top(answer).share.value)
    return f", {typeset(away)}" if away else ""


def _one_heading(answer: CausesResult) -> Note | None:
    if answer.is_parted or not answer.is_strapdown:
        return None
    return Note(
        "The aircraft kept nearly one heading: what is fixed to it cannot be told from what is fixed to north and "
        "east, nor an accelerometer bias from a tilt. Turns by 90° or more would tell.",
        "unknown",
    )


def _within(one: Within95 | None, places: int) -> str:
    if one is None:
        return ABSENT
    return f"{number(one.value, places)} ({number(one.low95, places)} … {number(one.high95, places)})"


def _half(one: Measured | None, places: int) -> str:
    if one is None:
        return ABSENT
    half = f" ± {number(one.half95, places)}" if one.half95 >= 0.5 * 10.0**-places else ""
    return f"{number(one.value, places, signed=True)}{half}"


def _shares(answer: CausesResult) -> Grid:
    heads = (Head("Cause"), Head("Share, %", True), Head("95 %", True), Head("From"))
    caption = (
        "Of the mean square velocity error, both channels; all add up to 100 % but for rounding. Below zero or above "
        "100: causes cancel. A bias that acts like a tilt counts as tilt, an azimuth or gyro error that acts like a "
        "constant drift as drift."
    )
    rows = [_share_row(one) for one in answer.shares if one.name != "reset" or answer.resets]
    return Grid("What explains the error", heads, rows, caption, ("causes_over_time",))


def _share_row(one: CauseShare) -> tuple[Cell, ...]:
    title, remark = CAUSES[one.name]
    low, high = (number(100.0 * end, 0) for end in (one.share.low95, one.share.high95))
    return (title, number(100.0 * one.share.value, 0), f"{low} … {high}", remark)


def _schuler(answer: CausesResult) -> Grid:
    heads = (
        Head("Channel"),
        Head("Amplitude, m/s", True),
        Head("Phase, °", True),
        Head("As of a tilt, arcsec / bias, µg", True),
        Head("Offset, m/s", True),
        Head("At the end, m/s", True),
        Head("Over the flight, m/s", True),
    )
    caption = (
        f"Velocity error = offset + amplitude cos(angle − phase), a turn in {number(answer.schuler_period_min, 1)} min "
        "from the first comparison on, by the start and the constant drift; at the end with what turns and random "
        "drift made of it; over the flight by plain least squares (its range is that of GNSS). The start alone "
        "(velocity error and tilt, both channels): "
        f"{_within(answer.start_mps, 2)} m/s, as of a tilt of {_within(answer.start_tilt_arcsec, 1)} arcsec. "
        "No phase: it may be any."
    )
    return Grid("Schuler oscillation", heads, [_wave_row(one) for one in answer.schuler], caption)


def _wave_row(one: SchulerWave) -> tuple[Cell, ...]:
    return (
        one.channel.capitalize(),
        _within(one.amplitude_mps, 2),
        _within(one.phase_deg, 0),
        f"{number(one.tilt_arcsec.value, 1)} / {number(one.bias_ug.value, 0)}",
        _within(one.offset_mps, 2),
        _within(one.end_mps, 2),
        _within(one.flight_mps, 2),
    )


def _parameters(answer: CausesResult) -> Grid:
    heads = (Head("Constant"), Head("Value", True), Head("±", True), Head("Seen", True), Head(""))
    caption = (
        "Seen: 1 − σ/σ before the flight; below 0.5 the value is mostly what the class assumes. What turns with the "
        "aircraft is an accelerometer bias or a gyro drift in body axes, what stays north and east is not."
    )
    return Grid("Constants of the INS", heads, [_parameter_row(one) for one in answer.parameters], caption)


def _parameter_row(one: CauseParameter) -> tuple[Cell, ...]:
    places = PLACES.get(one.unit, 3)
    return (
        f"{capitalised(one.title)}, {SIGNS.get(one.unit) or unit_sign(one.unit)}",
        number(one.value, places, signed=True),
        number(one.half95, places),
        number(one.observability, 2),
        Mark("good", "Observable") if one.is_observable else Mark("unknown", "Not observable"),
    )


def _legs(answer: CausesResult) -> Grid | None:
    if not answer.legs:
        return None
    heads = (
        Head("Leg"),
        Head("Course, °", True),
        Head("Length, km", True),
        Head("Error along, nmi/h", True),
        Head("Across", True),
        Head("Velocity change along, m/s", True),
        Head("Across", True),
    )
    more = f" {answer.legs_left_out} shorter legs are left out." if answer.legs_left_out else ""
    caption = (
        "Straight for three minutes or more; across is to the right. Growth of the position error, and change of the "
        "velocity error from the first to the last half minute; ± is that of GNSS, left out where it rounds to "
        f"nothing.{more}"
    )
    return Grid("Straight legs", heads, [_leg_row(one) for one in answer.legs], caption, ("causes_along",))


def _leg_row(one: StraightLeg) -> tuple[Cell, ...]:
    return (
        f"{clock(one.start_s)} – {clock(one.end_s)}",
        number(one.course_deg, 0),
        number(one.length_km, 0),
        _half(one.along_rate_nmiph, 2),
        _half(one.across_rate_nmiph, 2),
        _half(one.along_change_mps, 2),
        _half(one.across_change_mps, 2),
    )


def _windows(answer: CausesResult) -> Grid | None:
    if not answer.windows:
        return None
    heads = (
        Head("Hours", True),
        Head("Since navigation began, m", True),
        Head("Windows, median, m", True),
        Head("95 %, m", True),
        Head("Windows", True),
        Head("Independent", True),
    )
    caption = (
        "Radial error so long after navigation began, and the error that builds up in windows of this length, one "
        "every five minutes; they overlap. The rate by the fit through the origin stands with the INS errors."
    )
    return Grid("Error by time", heads, [_window_row(one) for one in answer.windows], caption)


def _window_row(one: ErrorWindow) -> tuple[Cell, ...]:
    return (
        f"{one.hours:g}",
        *(number(value, 0) for value in (one.since_start_m, one.median_m, one.p95_m)),
        number(one.windows, 0),
        number(one.independent, 0),
    )


def _facts(answer: CausesResult) -> Facts:
    pairs = [
        (f"{one.quantity.capitalize()} error RMS along / across the track", _both(one.along, one.across, one.unit), "")
        for one in answer.along_across
    ]
    pairs += [
        ("Fitted over", f"{number(answer.hours, 2)} h", f"{answer.ins_topic} against {answer.gnss_topic}"),
        ("INS class", answer.ins_class or ABSENT, "random drift and what is assumed before the flight"),
        ("Spread of headings", number(answer.heading_spread, 2), "0: one heading, 1: all alike"),
    ]
    return Facts("Errors along the track", pairs)


def _both(along: float, across: float, unit: str) -> str:
    places = 0 if unit == "m" else 2
    return f"{number(along, places)} / {number(across, places)} {unit}"
