"""Recorded approaches as an analysis: every final of a flight against its runway."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import METRES_PER_DEG
from groundstation.base.signals import topics_of_kind
from groundstation.results.answer import Answers, answer_of
from groundstation.results.arrays.typed import joined
from groundstation.results.figures import FigureData
from groundstation.results.landing_categories import ACCURACY_ONLY, axis_category_met
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.analysis import Analysis, Found, RestsOn, Rules, Shortfall, main_numbers
from groundstation.systems.known import Known
from groundstation.systems.landing.along import along_error
from groundstation.systems.landing.answer import (
    AlongError,
    Approach,
    Established,
    HeightError,
    LandingResult,
    LeftOutApproach,
    PositionError,
    RunwayUsed,
    Sensitivity,
)
from groundstation.systems.landing.arrays import LandingPath, LandingProtection
from groundstation.systems.landing.columns import COLUMNS
from groundstation.systems.landing.criteria import criteria_of, score_of
from groundstation.systems.landing.finals import Final, ends_of, final_of
from groundstation.systems.landing.findings import findings_of
from groundstation.systems.landing.geometry import (
    ROLL_OUT_MIN_MPS,
    ROLL_OUT_S,
    RelativeToRunway,
    along_and_across,
    line_through,
    relative_to_runway,
    runway_of,
    samples_of_final,
)
from groundstation.systems.landing.height import height_error
from groundstation.systems.landing.logged import Logged, logged_of
from groundstation.systems.landing.no_end import why_no_end
from groundstation.systems.landing.path import FlightPath, path_of, position_topics, step_of
from groundstation.systems.landing.protection import protection_along
from groundstation.systems.landing.reference import (
    Positions,
    fits,
    position_error,
    sensitivity_of,
)
from groundstation.systems.landing.settings import LIMITS, LandingSettings
from groundstation.systems.landing.stabilised import rejudge, stabilised
from groundstation.systems.landing.touchdown import is_set_down, touchdown_of, with_evidence
from groundstation.systems.landing.verdict_answer import line_of_approaches

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

SATELLITES = "GPS"  # as recorders name the source of guidance
TURN_S = 180.0  # before a final, in which it is turned onto the course
SET_DOWN = "comes down too slowly to roll, as a helicopter does: no touchdown on wheels"
MOST_ANALYSED = 50  # a log of many circuits takes no longer


@dataclass(frozen=True, eq=False)
class _Told:
    """An approach with the arrays behind its figures."""

    approach: Approach
    path: LandingPath
    protection: LandingProtection | None


def _run(flight: "Flight", known: Known, settings: LandingSettings) -> Found[LandingResult]:
    path, finals, left_out = _finals(flight, known, settings)
    estimated = known.answer_meeting(StatesAlongTheFlight)
    logged = logged_of(flight, path)
    told = [
        _approach(number, flight, path, final, settings, estimated, logged) for number, final in enumerate(finals, 1)
    ]
    approaches = tuple(one.approach for one in told)
    answer = LandingResult(
        approaches=approaches,
        left_out=left_out,
        remarks=(ACCURACY_ONLY,),
        settings=settings.told(),
        figures=_figures(told),
    )
    return Found(answer, findings_of(answer, known.runways_problem))


def _finals(
    flight: "Flight", known: Known, settings: LandingSettings
) -> tuple[FlightPath, list[Final], tuple[LeftOutApproach, ...]]:
    """The path of a flight, its straight finals, and the ends that none leads to.

    Raises
    ------
    NotAssessableError
        Where there is no final.
    """
    path = path_of(flight, settings)
    ends = tuple(with_evidence(flight, path, end) for end in ends_of(path, known.phases, settings)[:MOST_ANALYSED])
    if not ends:
        raise NotAssessableError("landing", why_no_end(flight, path, known.phases))
    found = [final_of(path, end, known.site, settings, known.runways) for end in ends]
    left_out = tuple(one for one in found if isinstance(one, LeftOutApproach))
    finals = [one for one in found if isinstance(one, Final)]
    if not finals:
        reasons = list(dict.fromkeys(one.reason for one in left_out))
        raise NotAssessableError("landing", f"no straight final: {'; '.join(reasons[:3])}")
    return path, finals, left_out


def _examine(flight: "Flight", known: Known, settings: LandingSettings) -> tuple[Shortfall, ...]:
    """Report ends without a final, and finals without a listed runway or without guidance."""
    path, finals, left_out = _finals(flight, known, settings)

    def where(some: list[Final]) -> tuple[tuple[float, float], ...]:
        return tuple((float(path.time_s[one.first]), one.end.time_s) for one in some)

    unlisted = [one for one in finals if one.runway is None and (one.chosen is None or one.chosen.runway is None)]
    unguided = [one for one in finals if one.guided is None]
    found = [Shortfall(f"no straight final: {one.reason}", ((one.time_s, one.time_s),)) for one in left_out]
    if unlisted:
        found.append(
            Shortfall(
                "no runway of the site file or the table: course and threshold from the positions", where(unlisted)
            )
        )
    if unguided:
        found.append(Shortfall("no guidance followed: errors across the course are not measured", where(unguided)))
    return tuple(found)


def _figures(told: Sequence[_Told]) -> tuple[FigureData, ...]:
    """All approaches, one after the other, and the protection levels of those that have any."""
    levels = [one.protection for one in told if one.protection is not None]
    return joined([one.path for one in told]), *([joined(levels)] if levels else [])


def _approach(
    number: int,
    flight: "Flight",
    path: FlightPath,
    final: Final,
    settings: LandingSettings,
    estimated: StatesAlongTheFlight | None,
    logged: Logged,
) -> _Told:
    runway = runway_of(path, final, settings)
    relative = relative_to_runway(path, final, runway)
    height = relative.height_m[relative.is_final]
    step_m, source = _step_m(path), _source(flight, path, final)
    sensitivity = (
        _sensitivity(path, relative, runway, source, float(np.hypot(*step_m))) if path.guidance_topic else None
    )
    errors, along = _position_errors(flight, path, final, runway, relative, source, sensitivity, settings)
    offset = None
    if final.guided is not None and SATELLITES in source:
        _, offset = _errors_of(flight, path.position_topic, path, runway, relative, final.guided, final, settings)
    protection = protection_along(flight, path.time_s[final.first], final.end.time_s, number)
    lands = final.end.touches
    touchdown = touchdown_of(flight, path, final, runway, relative, estimated) if lands else None
    checks = stabilised(path, relative, logged, settings)
    criteria = criteria_of(path, final, runway, relative, logged, touchdown, step_m, (errors, along), settings)
    approach = Approach(
        number=number,
        outcome=final.end.outcome,
        start_s=float(path.time_s[final.first]),
        end_s=final.end.time_s,
        final_length_m=float(relative.distance_m[0]),
        lowest_height_m=float(np.nanmin(height)) if np.isfinite(height).any() else None,
        position_topic=path.position_topic,
        guidance_topic=path.guidance_topic,
        guidance_source=source,
        height_source=path.altitude_source,
        runway=runway,
        established=_guided_part(path, final, relative),
        sensitivity=sensitivity,
        touchdown=touchdown,
        stabilised=checks,
        position_errors=errors,
        protection=None if protection is None else protection[0],
        claim=_claim(errors, runway),
        position_step_m=step_m if any(step_m) else None,
        along_errors=along,
        path_offset=offset,
        touchdown_reason=SET_DOWN if lands and is_set_down(path, final.end) else "",
        height_errors=_height_errors(flight, path, runway, final.end.time_s, settings) if lands else (),
        criteria=criteria,
        score=score_of(checks, criteria, settings),
    )
    return _Told(approach, samples_of_final(number, path, relative), None if protection is None else protection[1])


def _step_m(path: FlightPath) -> tuple[float, float]:
    """Steps in which positions are written, north and east, metres; 0 where too fine to count."""
    cosine = float(np.cos(np.deg2rad(np.median(path.latitude_deg))))
    return step_of(path.latitude_deg) * METRES_PER_DEG, step_of(path.latitude_deg) * METRES_PER_DEG * cosine


def _source(flight: "Flight", path: FlightPath, final: Final) -> str:
    """Return the source of guidance at the end of the final, as the recorder names it."""
    if not path.guidance_topic:
        return ""
    table = flight[path.guidance_topic]
    names = table.text("source")[flight.time_s(path.guidance_topic) <= final.end.time_s]
    frequency = table.values("frequency_mhz")[flight.time_s(path.guidance_topic) <= final.end.time_s]
    name = next((str(one) for one in names[::-1] if one), "")
    tuned = frequency[np.isfinite(frequency)]
    return name or (f"{tuned[-1]:.2f} MHz" if tuned.size else "")


def _guided_part(path: FlightPath, final: Final, relative: RelativeToRunway) -> Established | None:
    rows = final.guided
    if rows is None:
        return None
    first, last = rows.start, rows.stop
    own = slice(first - relative.rows.start, last - relative.rows.start)
    line = line_through(path, rows)
    height = relative.height_m[own]
    vertical_m, vertical_dots = _rms(relative.vertical_guidance_m[own]), _rms(path.vertical_dots[rows])
    return Established(
        start_s=float(path.time_s[first]),
        end_s=float(path.time_s[last - 1]),
        length_m=line.length_m,
        start_height_m=_or_none(height[0]),
        end_height_m=_or_none(height[-1]),
        line_course_deg=line.course_deg,
        lateral_rms_dots=_rms(path.lateral_dots[rows]) or 0.0,
        vertical_rms_dots=vertical_dots,
        lateral_rms_m=_rms(relative.lateral_guidance_m[own]) or 0.0,
        vertical_rms_m=vertical_m,
    )


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _rms(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def _sensitivity(
    path: FlightPath, relative: RelativeToRunway, runway: RunwayUsed, source: str, step_m: float
) -> Sensitivity:
    """Estimate the localizer's sensitivity on the final and the turn onto it.

    The final alone has few deviations. Satellite guidance is judged on the final only.
    """
    last = relative.rows.start + int(np.count_nonzero(relative.is_final))
    first = relative.rows.start
    if SATELLITES not in source:  # which guides along the leg before, until the turn is made
        first = int(np.searchsorted(path.time_s, path.time_s[first] - TURN_S))
    distance_m, across_m = along_and_across(path.latitude_deg[first:last], path.longitude_deg[first:last], runway)
    return sensitivity_of(path.time_s[first:last], path.lateral_dots[first:last], distance_m, across_m, runway, step_m)


def _position_errors(
    flight: "Flight",
    path: FlightPath,
    final: Final,
    runway: RunwayUsed,
    relative: RelativeToRunway,
    source: str,
    sensitivity: Sensitivity | None,
    settings: LandingSettings,
) -> tuple[tuple[PositionError, ...], tuple[AlongError, ...]]:
    """Return the errors of each source of positions across and along the course.

    Nothing where no localizer was followed.
    """
    guided = final.guided
    if guided is None:
        return (), ()
    if SATELLITES in source:
        reason = "guidance was by a satellite receiver, not a localizer"
        return (PositionError(path.position_topic, "not measured", reason, 0),), ()
    if sensitivity is not None and not fits(sensitivity):
        reason = f"positions move by {sensitivity.ratio:.2f} of what the localizer shows: no reference"
        return (PositionError(path.position_topic, "not measured", reason, 0),), ()
    both = [
        _errors_of(flight, topic, path, runway, relative, guided, final, settings) for topic in position_topics(flight)
    ]
    return tuple(across for across, _along in both), tuple(along for _across, along in both)


def _height_errors(
    flight: "Flight", path: FlightPath, runway: RunwayUsed, touchdown_s: float, settings: LandingSettings
) -> tuple[HeightError, ...]:
    """The error of each recorded altitude of an INS or receiver on the roll-out."""
    found = (height_error(flight, topic, path, runway, touchdown_s, settings) for topic in position_topics(flight))
    return tuple(one for one in found if one is not None)


def _errors_of(
    flight: "Flight",
    topic: str,
    path: FlightPath,
    runway: RunwayUsed,
    relative: RelativeToRunway,
    guided: slice,
    final: Final,
    settings: LandingSettings,
) -> tuple[PositionError, AlongError]:
    """Return the errors of a topic's positions on the guided part, then on the roll-out."""
    end = final.end
    table = flight[topic].unique_times()
    time_s = flight.seconds(table.time_ns)
    guided_from_s, guided_until_s = float(path.time_s[guided.start]), float(path.time_s[guided.stop - 1])
    last_s = min(end.time_s + ROLL_OUT_S, end.until_s) if end.touches else end.time_s
    rows = table.valid("latitude_deg", "longitude_deg") & (time_s >= guided_from_s) & (time_s <= last_s)
    table, time_s = table.take(rows), time_s[rows]
    steps = (step_of(flight[topic].values("latitude_deg")),) * 2
    shift = 0.5 if settings.positions_rounded == "down" else 0.0
    latitude, longitude = (
        table.values(name) + shift * step for name, step in zip(("latitude_deg", "longitude_deg"), steps, strict=True)
    )
    distance_m, _across = along_and_across(latitude, longitude, runway)
    order = np.argsort(distance_m)
    crossing_s = float(np.interp(0.0, distance_m[order], time_s[order])) if len(order) else guided_until_s
    speed = np.interp(time_s, path.time_s, path.ground_speed_mps)
    positions = Positions(topic, time_s - crossing_s, latitude, longitude, steps)
    across = position_error(
        positions,
        np.interp(time_s, path.time_s, path.lateral_dots, left=np.nan, right=np.nan),
        time_s <= guided_until_s,
        (time_s > end.time_s) & (speed >= ROLL_OUT_MIN_MPS),
        runway,
        crossing_s,
        settings,
    )
    return across, along_error(positions, crossing_s, path, final, runway, relative, settings)


def _claim(errors: tuple[PositionError, ...], runway: RunwayUsed) -> str:
    """Tell what accuracy across the course the log supports."""
    measured = next((one for one in errors if one.state == "measured"), None)
    if measured is None or measured.confidence95_m is None:
        return "" if not errors else errors[0].reason
    bound_m = max(abs(end) for end in measured.confidence95_m)
    met = axis_category_met(bound_m, "horizontal")
    text = (
        f"{measured.topic} within {bound_m:.0f} m across the course at the threshold, with the localizer as reference"
    )
    return f"{text}: {'the figure of ' + met.label if met else 'no category'} across the course"


def _is_expected(flight: "Flight", _known: Known) -> bool:
    return any(topics_of_kind("guidance", flight.topics()))


def _rests_on(_flight: "Flight", answer: LandingResult) -> RestsOn:
    topics = {one.position_topic for one in answer.approaches} | {one.guidance_topic for one in answer.approaches}
    fields = ("latitude_deg", "longitude_deg", "lateral_deviation_dots", "vertical_deviation_dots")
    spans = tuple((one.start_s, one.end_s) for one in answer.approaches)
    return RestsOn(tuple(sorted(topics - {""})), fields, spans)


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, LandingResult)
    return "" if answer is None else line_of_approaches(answer)


LANDING = Analysis(
    name="landing",
    title="approaches and landings against their runway, localizer and glide path",
    subject="approach",
    page_title="Approaches",
    needs="positions, a height, a landing or a go-around; guidance deviations and a site file with the runway add more",
    settings=LandingSettings,
    answer=LandingResult,
    run=_run,
    builds_on=("trajectory",),
    is_expected=_is_expected,
    rests_on=_rests_on,
    sentence=_sentence,
    columns=COLUMNS,
    rules=Rules(LIMITS, rejudge),
    examine=_examine,
    is_main=main_numbers("verdict"),
    compared=(
        *("landing_approaches", "landing_go_arounds", "landing_runway", "landing_stabilised"),
        *("landing_unstable_approaches", "landing_touchdown_m", "landing_sink_rate_mps", "landing_lateral_rms_dots"),
        "landing_vertical_rms_dots",
    ),
)
