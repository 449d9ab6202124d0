"""Chapter on recorded approaches.

How each was flown, where it touched down, and what shows accuracy.
"""

from groundstation.base.units import DOTS_PER_FULL_SCALE
from groundstation.base.words import capitalised
from groundstation.chapters.chapter import Remedies
from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import (
    Cell,
    Claim,
    Facts,
    Figure,
    Grid,
    Head,
    Mark,
    Note,
    Part,
    Rank,
    Section,
    Tone,
    kept,
)
from groundstation.chapters.wording import (
    ABSENT,
    clock,
    interval,
    is_number,
    number,
    percent,
    plural,
    sentence,
    significant,
    typeset,
    with_feet,
)
from groundstation.results.flight import FlightResults
from groundstation.systems.landing.answer import (
    GLIDE_SLOPE_DOT,
    Approach,
    HeightError,
    LandingResult,
    PositionError,
)
from groundstation.systems.landing.criteria_chapter import criteria_parts
from groundstation.systems.landing.runway_chapter import along_facts, along_told, path_told, runway_facts, with_sigma
from groundstation.systems.landing.touchdown_chapter import SINK_TIME, touchdown_parts
from groundstation.systems.landing.verdict_answer import verdict_words, worst_verdict

LEAD = "How each approach was flown against its runway, and where it touched down."
SOURCES = (
    ("FSF ALAR", "Flight Safety Foundation, ALAR Briefing Note 7.1: deviations, sink rate, speed, configuration"),
    ("EASA GM2 ORO.AOC.130", "ED Decision 2025/020/R: events of flight data monitoring, without limits"),
    ("Airbus FOBN", "Airbus Flight Operations Briefing Notes: bank"),
    ("ICAO Annex 10", "Volume I, table 3.7.2.4-1: alarm limits; Satellite Navigation 1, 2020: accuracy"),
)
TITLE = "Approaches"
NOT_STABILISED, NOT_MEASURED = "not stabilised", "not measured"
TONES: dict[str, Tone] = {"stabilised": "good", NOT_STABILISED: "warn", NOT_MEASURED: "unknown"}
MOST_TOLD, MOST_ALSO = 6, 2
HOW = (
    "How computed: a final leads straight to a touchdown, or follows the guidance down to a height where a climb "
    f"begins. Deviations are converted to metres by the course sector ({DOTS_PER_FULL_SCALE:g} dots to its edge) and "
    f"by {GLIDE_SLOPE_DOT:g} of the glide angle per dot. If runway and localizer are known, position minus localizer "
    "is the error across the course, without GNSS: generalised least squares, with tolerances of course line, bends, "
    "width, steps and runway bearing in the covariance. Height and glide path give the error along the course. The "
    "runway is that of the site file, else the likeliest of the table of runways (OurAirports, public domain, "
    "unofficial), whose uncertainty is in the intervals."
)
REMEDIES: Remedies = (("no position of the aircraft", ("Record", "positions")),)


def landing(results: FlightResults) -> Section | None:
    """Return the chapter; None without approaches."""
    answer = results.answer(LandingResult)
    if answer is None:
        return None
    told = answer.approaches[:MOST_TOLD]
    parts: list[Part | None] = [_overview(answer)]
    for one in told:
        parts += _approach(one, answer, results.start_utc_ns)
    if len(answer.approaches) > MOST_TOLD:
        parts.append(Note(f"Approaches {MOST_TOLD + 1} to {len(answer.approaches)} are only in the table above."))
    parts += [_left_out(answer), *(Note(sentence(remark)) for remark in answer.remarks)]
    workings = (
        *(_basis(one) for one in told),
        *(Note(HOW), setting_facts(answer.settings, "landing")),
    )
    headline, claim = _headline(answer), _claim(answer)
    return Section("landing", TITLE, LEAD, kept(parts), headline, claim=claim, appendix=kept(workings))


def _claim(answer: LandingResult) -> Claim | None:
    """Return the last landing, or the last approach of a flight without one."""
    one = answer.last
    if one is None:
        return None
    state = _verdict(one)
    others = [f"{_name(other)}: {_verdict(other).text}" for other in answer.approaches if other is not one]
    also = f" Also in the log: {'; '.join(others[:MOST_ALSO])}{' ...' if others[MOST_ALSO:] else ''}." if others else ""
    return Claim(
        Rank.LANDING_OPEN if state.text == NOT_MEASURED else Rank.LANDING,
        Mark(state.tone, state.text.capitalize()),
        capitalised(_name(one)),
        value=state.text.capitalize(),
        remark=_name(one),
        sentences=(f"{_why(one)}{also}",),
        figures=_figures(one),
        is_danger=state.text == NOT_STABILISED,
    )


def _why(one: Approach) -> str:
    """Return the verdicts from the check heights down, each with what it rests on."""
    return " ".join(sentence(told) for told in verdict_words(one.stabilised))


def _figures(one: Approach) -> tuple[tuple[str, str, str], ...]:
    on, down = one.established, one.touchdown
    error = next((row for row in one.position_errors if row.state == "measured"), None)
    along = next((row for row in one.along_errors if row.state == "measured"), None)
    found = (
        ("Off the course", number(on.lateral_rms_dots, 2, "dot") if on else ABSENT, "RMS while established"),
        ("Off the path", number(on.vertical_rms_dots, 2, "dot") if on else ABSENT, "RMS while established"),
        ("Sink rate at touchdown", number(down.sink_rate_mps, 1, "m/s") if down else ABSENT, SINK_TIME),
        (
            "Positions across the course",
            number(error.error_m, 0, "m", signed=True) if error else ABSENT,
            f"{error.topic} by the localizer; 95 % {interval(error.confidence95_m, 0, 'm')}" if error else "",
        ),
        (
            "Positions along the course",
            number(along.error_m, 0, "m", signed=True) if along else ABSENT,
            f"{along.topic} by the glide path; 95 % {interval(along.confidence95_m, 0, 'm')}" if along else "",
        ),
    )
    return tuple(figure for figure in found if figure[1] != ABSENT)


def _headline(answer: LandingResult) -> str:
    downs = [(one, f", touchdown {one.touchdown.moment}" if one.touchdown else "") for one in answer.approaches[:3]]
    return "; ".join(f"{_name(one)}: {_verdict(one).text}{down}" for one, down in downs)


def _name(one: Approach) -> str:
    where = f"runway {typeset(one.runway.name)}" if one.runway.name else f"course {_course(one)}"
    return f"{one.outcome}, {where}"


def _course(one: Approach) -> str:
    return number(one.runway.true_course_deg, 1, "°")


def _verdict(one: Approach) -> Mark:
    """Return the worse of the verdicts from both check heights."""
    worst = worst_verdict(one.stabilised)
    return Mark(TONES[worst], worst)


def _overview(answer: LandingResult) -> Grid:
    titles = ("Straight for, km", "Lateral RMS, dot", "Vertical RMS, dot", "Touchdown, m/s down", "Peak, g")
    checked = max((one.stabilised for one in answer.approaches), key=len, default=())
    heads = (
        *(Head(title) for title in ("", "Approach", "Flight time", "Guidance")),
        *(Head(f"From {with_feet(at.height_m)}") for at in checked),
        *(Head(title, True) for title in titles),
    )
    lateral, vertical = (
        significant(answer.settings.get(f"established_{axis}_dots")) for axis in ("lateral", "vertical")
    )
    caption = (
        f"RMS of the guidance deviations while established: within {lateral} dot of the course and {vertical} dot of "
        "the path."
    )
    rows = [_row(one, len(checked)) for one in answer.approaches]
    return Grid("Approaches", heads, rows, caption, ("landing_path",))


def _row(one: Approach, checks: int) -> tuple[Cell, ...]:
    on, down = one.established, one.touchdown
    return (
        str(one.number),
        _name(one),
        f"{clock(one.start_s)} – {clock(one.end_s)}",
        typeset(one.guidance_source or ("ILS" if one.guidance_topic else ABSENT)),
        *(Mark(TONES[at.verdict], at.verdict) for at in one.stabilised),
        *[ABSENT] * (checks - len(one.stabilised)),
        number(one.final_length_m / 1000.0, 1),
        number(on.lateral_rms_dots, 3) if on else ABSENT,
        number(on.vertical_rms_dots, 3) if on else ABSENT,
        number(down.sink_rate_mps, 1) if down else ABSENT,
        number(down.peak_load_g, 2) if down else ABSENT,
    )


def _approach(one: Approach, answer: LandingResult, start_utc_ns: int | None) -> list[Part | None]:
    of = str(one.number)
    return [
        Note(" ".join(filter(None, (f"Approach {one.number}, {_name(one)}.", _why(one), _told(one))))),
        Figure("landing.deviations", of),
        Figure("landing.final", of),
        Figure("landing.runway", of) if one.runway.is_surveyed and one.runway.length_m else None,
        runway_facts(one),
        *criteria_parts(one, answer.settings.get("gate_floor_m")),
        *touchdown_parts(one, start_utc_ns),
        *(_error(one, error) for error in one.position_errors),
        *(along_facts(one, error) for error in one.along_errors),
        *(_height(one, error) for error in one.height_errors),
        Figure("landing.protection", of) if one.protection else None,
        _protection(one),
    ]


def _told(one: Approach) -> str:
    """Return what a reader must know before the figures."""
    told = [_accuracy(error) for error in one.position_errors[:2]]
    told += filter(None, (along_told(error) for error in one.along_errors[:2]))
    told.append(path_told(one))
    if one.protection is not None:
        told.append(
            "No reference: protection levels bound the error at the integrity that the receiver claims; they are not "
            "errors."
        )
    if not one.guidance_topic:
        told.append("The log has no guidance; deviations are those of the positions from a line through them.")
    return " ".join(filter(None, told))


def _accuracy(error: PositionError) -> str:
    if error.state == "measured":
        return (
            f"With the localizer as reference, {error.topic} is {number(error.error_m, 0, 'm', signed=True)} across "
            f"the course at the threshold (95 % {interval(error.confidence95_m, 0, 'm')}), right positive."
        )
    return f"Error of {error.topic} across the course not measured: {typeset(error.reason)}."


def _error(one: Approach, error: PositionError) -> Grid | Facts | None:
    if error.state == "measured":
        rate = with_sigma(error.rate_mps, error.rate_sigma_mps, 2, "m/s")
        pairs = [
            (
                "At the threshold",
                with_sigma(error.error_m, error.sigma_m),
                f"95 % {interval(error.confidence95_m, 0, 'm')}",
            ),
            ("Growth", rate, "along the final"),
            ("On the roll-out", with_sigma(error.rollout_error_m, error.rollout_sigma_m), "centre line as truth"),
            ("Roll-out − final", with_sigma(error.change_m, error.change_sigma_m), "each checks the other"),
            ("Per hour", number(error.drift_nmi_per_h, 2, "nmi/h"), "over the flight so far, across the course only"),
            ("Residuals", number(error.residual_ratio, 2), "RMS over expected RMS"),
            *((f"σ by {part.name}", number(part.sigma_m, 1, "m"), "") for part in error.parts),
        ]
        return Facts(f"Approach {one.number}: {error.topic} across the course, by the localizer", tuple(pairs))
    if not is_number(error.change_m):
        return None
    pair = (
        "Roll-out − final",
        with_sigma(error.change_m, error.change_sigma_m),
        "on the course of the final, continued",
    )
    return Facts(f"Approach {one.number}: {error.topic} across the course", (pair,))


def _height(one: Approach, error: HeightError) -> Facts | None:
    if error.state != "measured":
        return None
    pairs = [
        ("On the roll-out", with_sigma(error.error_m, error.sigma_m), f"95 % {interval(error.confidence95_m, 0, 'm')}"),
        *((f"σ by {part.name}", number(part.sigma_m, 1, "m"), "") for part in error.parts),
    ]
    return Facts(f"Approach {one.number}: altitude of {error.topic}, by the elevation of the runway", tuple(pairs))


def _protection(one: Approach) -> Facts | None:
    found = one.protection
    if found is None:
        return None
    pairs = (
        ("Horizontal, greatest", number(found.horizontal_max_m, 1, "m"), _limit(found.horizontal_alarm_limit_m)),
        ("Vertical, greatest", number(found.vertical_max_m, 1, "m"), _limit(found.vertical_alarm_limit_m)),
        ("Within the alarm limits", percent(found.within_share), f"of {plural(found.epochs, 'epoch')}"),
        ("Meets the alarm limits of", "; ".join(found.operations) or ABSENT, "ICAO Annex 10, table 3.7.2.4-1"),
    )
    return Facts(f"Approach {one.number}: protection levels", pairs)


def _limit(limit_m: float | None) -> str:
    return f"alarm limit {number(limit_m, 0, 'm')}" if is_number(limit_m) else "no alarm limit logged"


def _basis(one: Approach) -> Facts:
    runway = one.runway
    step = one.position_step_m
    pairs = [
        ("Positions", one.position_topic, f"steps of {number(step[0], 0)} × {number(step[1], 0, 'm')}" if step else ""),
        ("Guidance", typeset(one.guidance_topic or ABSENT), typeset(one.guidance_source)),
        ("Height", typeset(one.height_source or ABSENT), ""),
        (
            "Runway",
            f"{_course(one)}, σ {number(runway.course_sigma_deg, 2, '°')}",
            f"placed by {runway.placed_by}" + (f", threshold {runway.place_reason}" if runway.place_reason else ""),
        ),
        (
            "Course sector",
            f"{number(runway.localizer_width_m, 0, 'm')} at the threshold",
            f"antenna {number(runway.localizer_distance_m, 0, 'm')} beyond it",
        ),
        (
            "Path",
            number(runway.glide_angle_deg, 2, "°"),
            f"{number(runway.threshold_crossing_height_m, 0, 'm')} above the threshold",
        ),
    ]
    if one.sensitivity is not None and is_number(one.sensitivity.ratio):
        value = f"{number(one.sensitivity.ratio, 2)}, σ {number(one.sensitivity.sigma, 2)}"
        pairs.append(("Positions over guidance", value, "1 if sense and width of the course are right"))
    return Facts(f"Approach {one.number}: basis", tuple(pairs), compact=False)


def _left_out(answer: LandingResult) -> Note | None:
    if not answer.left_out:
        return None
    rows = "; ".join(f"{clock(one.time_s)} {typeset(one.reason)}" for one in answer.left_out[:5])
    return Note(f"Not counted as approaches: {rows}.")
