"""Landing by two locators and an additional beacon as an analysis of a flight."""

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.words import counted
from groundstation.results.answer import Answers, answer_of
from groundstation.results.columns import AnswerColumn
from groundstation.systems.analysis import Analysis, Found
from groundstation.systems.known import Beacon, Known, Runway, SiteData
from groundstation.systems.landing.beacons.answer import BeaconLanding, DeviationRow
from groundstation.systems.landing.beacons.approach import (
    Deviations,
    PlaceEvidence,
    Sampled,
    approaches_in,
    belief,
    deviations,
    over_known_ground,
    unknown_rise_m,
)
from groundstation.systems.landing.beacons.outcome import beacon_landing
from groundstation.systems.landing.beacons.settings import LandingBeaconsSettings
from groundstation.tables.phases import GROUND_PHASES
from groundstation.tables.resample import values_at
from groundstation.tables.sources import sources_of_kind

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

Value = TypeVar("Value")
NAME, PREFIX, BEARING = "landing_beacons", "adf.", "relative_bearing_deg"
LEAST_BEACONS, LEAST_WIDTH_M = 3, 50.0
SPEED_SHARE, HEADING_DEG, CUT_SHORT_M = 0.3, 10.0, 300.0
GROUND_NEXT = "the site file may give the ground under the approach ([[runways.ground]])"
NEXT = "correct the beacons of the site file or the scale of the direction finder in the profile"


def _run(flight: "Flight", known: Known, settings: LandingBeaconsSettings) -> Found[BeaconLanding]:
    runway, beacons = _beacons_heard(flight, known.site)
    sampled = _sampled(flight, known, beacons, settings)
    spans = approaches_in(sampled, settings)
    if not spans:
        what = f"no flight of {settings.shortest_s:g} s below {settings.highest_m:g} m with bearings of all beacons"
        raise NotAssessableError(NAME, what)
    places = np.array([(-beacon.before_threshold_m, beacon.right_m) for beacon in beacons])
    kept: list[tuple[Sampled, Deviations, PlaceEvidence]] = []
    findings: list[Finding] = []
    for span in spans:
        part = sampled.part(span)
        found = deviations(part, places, runway, settings)
        told = belief(part, found, runway)
        problem = _why_not(told.speed_mps)
        if problem:
            findings.append(_finding("warn", "rejected", f"approach from {part.time_s[0]:.0f} s: {problem}"))
            continue
        number = len(kept) + 1
        rise_m = unknown_rise_m(part, told, runway)
        kept.append((part, over_known_ground(found, rise_m, settings.terrain_m), told))
        findings += [
            _finding(severity, kind, f"approach {number}: {text}")
            for severity, kind, text in _doubts(part, found, told, runway, settings)
        ]
    if not kept:
        raise NotAssessableError(NAME, findings[0].text, next_step=NEXT)
    return Found(beacon_landing(runway, beacons, kept, settings), tuple(findings))


def _finding(severity: str, kind: str, text: str) -> Finding:
    return Finding("warn" if severity == "warn" else "info", f"{NAME}.{kind}", text)


def _beacons_heard(flight: "Flight", site: SiteData) -> tuple[Runway, tuple[Beacon, ...]]:
    """The runway and its beacons that the log has bearings of.

    Raises
    ------
    NotAssessableError
        Where log and site file do not make a place.
    """
    heard = [topic for topic in flight.topics() if topic.startswith(PREFIX) and flight[topic].has(BEARING)]
    if not heard:
        raise NotAssessableError(NAME, "no bearings of locators in the log (adf.<beacon>)")
    if not site.runways or not site.beacons:
        raise NotAssessableError(NAME, "no [[runways]] with [[beacons]] in the site file")
    name = next((one.runway for one in site.beacons if one.runway), site.runways[0].name)
    runway = next(one for one in site.runways if one.name == name)
    beacons = tuple(one for one in site.beacons if one.runway in ("", name) and f"{PREFIX}{one.name}" in heard)
    if len(beacons) < LEAST_BEACONS:
        names = ", ".join(one.name for one in beacons) or "none"
        raise NotAssessableError(NAME, f"bearings of {names}, where three beacons of one runway are needed")
    if not _has_height(flight):
        raise NotAssessableError(NAME, "no radio altitude in the log")
    places = np.array([(-one.before_threshold_m, one.right_m) for one in beacons])
    width_m = float(np.linalg.svd(places - places.mean(axis=0), compute_uv=False)[-1])
    if width_m < LEAST_WIDTH_M:
        raise NotAssessableError(NAME, "beacons on one line: bearings of them show no distance")
    return runway, beacons


def _has_height(flight: "Flight") -> bool:
    """Tell whether the log has a radio altitude."""
    return any(flight[topic].has("height_m") for topic in topics_of_kind("radio_altimeter", flight.topics()))


def _sampled(flight: "Flight", known: Known, beacons: tuple[Beacon, ...], settings: LandingBeaconsSettings) -> Sampled:
    """Everything at the times of the first beacon's bearings."""
    topics = [f"{PREFIX}{beacon.name}" for beacon in beacons]
    time_ns = flight[topics[0]].unique_times().time_ns

    def of_kind(kind: str, *names: str) -> FloatArray:
        """The first of the fields that an instance of the kind has."""
        for topic in sources_of_kind(flight, kind):
            for name in names:
                if flight[topic].has(name):
                    return values_at(flight[topic], name, time_ns, largest_gap_s=settings.largest_gap_s)
        return np.full(len(time_ns), np.nan)

    north, east = of_kind("ins", "velocity_north_mps"), of_kind("ins", "velocity_east_mps")
    altitude_m = of_kind("ins", "altitude_ellipsoid_m", "altitude_msl_m")
    time_s = flight.seconds(time_ns)
    return Sampled(
        time_s=time_s,
        bearings_deg=np.column_stack([_bearings(flight, topic, time_ns, settings) for topic in topics]),
        height_m=of_kind("radio_altimeter", "height_m"),
        is_airborne=~np.isin(known.phases.at(time_s), GROUND_PHASES),
        altitude_m=altitude_m if np.isfinite(altitude_m).any() else of_kind("baro", "pressure_altitude_m"),
        ground_speed_mps=np.hypot(north, east),
        heading_deg=of_kind("ins", "true_heading_deg"),
    )


def _bearings(flight: "Flight", topic: str, time_ns: Int64Array, settings: LandingBeaconsSettings) -> FloatArray:
    return values_at(flight[topic], BEARING, time_ns, largest_gap_s=settings.largest_gap_s)


def _why_not(speed_mps: float) -> str:
    """Return why the places of an approach cannot be right; empty where they can."""
    wrong = "bearings of the wrong sign or quadrant, or beacons on the wrong side of the runway"
    if not np.isfinite(speed_mps):
        return f"bearings and beacons give too few places: {wrong}"
    if speed_mps <= 0.0:
        return f"the distance grows along the approach: {wrong}, or a flight away from the runway"
    return ""


def _doubts(
    part: Sampled, found: Deviations, told: PlaceEvidence, runway: Runway, settings: LandingBeaconsSettings
) -> list[tuple[str, str, str]]:
    """Severity, kind and text of what speaks against an approach."""
    doubts = []
    ratio = told.speed_mps / told.ground_speed_mps if told.ground_speed_mps else np.nan
    if abs(ratio - 1.0) > SPEED_SHARE:
        text = f"the distance shrinks at {told.speed_mps:.0f} m/s, ground speed is {told.ground_speed_mps:.0f} m/s"
        doubts.append(("warn", "speed", f"{text}: {NEXT}"))
    if abs(told.heading_difference_deg) > HEADING_DEG:
        text = f"heading by the bearings is {told.heading_difference_deg:+.0f} deg off that of the INS"
        doubts.append(("warn", "heading", f"{text}: {NEXT}, or the bearing of the runway"))
    if told.terrain_m > settings.terrain_m:
        text = f"the ground height varies by {told.terrain_m:.0f} m (radio altitude against altitude)"
        if runway.ground:
            text += ", after the profile of the site file is subtracted"
        left_out = f"no deviation from the glide path where it is more than {settings.terrain_m:g} m"
        doubts.append(("warn", "terrain", f"{text}: {left_out}; {GROUND_NEXT}"))
    elif not np.isfinite(told.terrain_m) and not runway.ground:
        text = "no altitude to find the terrain: deviations from the glide path assume level ground"
        doubts.append(("warn", "terrain", f"{text}; {GROUND_NEXT}"))
    last_m = float(found.before_m[found.found][-1])
    if last_m > CUT_SHORT_M:
        doubts.append(("info", "cut_short", f"it ends {last_m:.0f} m before the threshold"))
    return doubts


def _is_expected(flight: "Flight", _known: Known) -> bool:
    return any(topic.startswith(PREFIX) for topic in flight.topics())


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, BeaconLanding)
    if answer is None:
        return ""
    count = len(answer.approaches)
    last = answer.rows[-1] if answer.rows else None
    where = ""
    if last is not None:
        where = f": {last.lateral_m:+.0f} +- {last.lateral_95_m:.0f} m off the course"
        if last.glide_path_m is not None and last.glide_path_95_m is not None:
            where += f" and {last.glide_path_m:+.0f} +- {last.glide_path_95_m:.0f} m off the glide path"
        where += f" {last.before_threshold_m:.0f} m before the threshold"
    return f"{counted(count, 'approach', 'approaches')} by bearings{where}"


def _last(value: Callable[[DeviationRow], Value]) -> Callable[[BeaconLanding], Value | None]:
    """Make a column of the row nearest to the threshold of the last approach."""
    return lambda landing: value(landing.rows[-1]) if landing.rows else None


COLUMNS: tuple[AnswerColumn[BeaconLanding], ...] = (
    AnswerColumn(
        "landing_beacons_approaches", "count", "approaches by bearings", lambda landing: len(landing.approaches)
    ),
    AnswerColumn(
        "landing_beacons_lateral_m",
        "number",
        "right of the course, nearest to the threshold of the last approach",
        _last(lambda row: row.lateral_m),
    ),
    AnswerColumn("landing_beacons_lateral_95_m", "number", "its 95 % uncertainty", _last(lambda row: row.lateral_95_m)),
    AnswerColumn(
        "landing_beacons_glide_path_m", "number", "above the glide path there", _last(lambda row: row.glide_path_m)
    ),
    AnswerColumn(
        "landing_beacons_glide_path_95_m", "number", "its 95 % uncertainty", _last(lambda row: row.glide_path_95_m)
    ),
)

LANDING_BEACONS = Analysis(
    name=NAME,
    title="approach by two locators and an additional beacon: deviations from course and glide path",
    subject="landing by locators",
    needs="adf.<beacon> relative_bearing_deg of three beacons, radio_altimeter height_m; [[runways]] and [[beacons]] "
    "in the site file",
    settings=LandingBeaconsSettings,
    answer=BeaconLanding,
    run=_run,
    is_expected=_is_expected,
    sentence=_sentence,
    columns=COLUMNS,
)
