"""Chapter on approaches by two locators and an additional beacon.

Deviations, their errors, what speaks against them.
"""

from groundstation.base.words import counted
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Claim, Figure, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, clock, number, sentence
from groundstation.results.flight import FlightResults
from groundstation.systems.landing.beacons.answer import BeaconApproachRow, BeaconLanding, DeviationRow

TITLE = "Landing by locators"
LEAD = (
    "Deviations from course and glide path, from the relative bearings of two locators and a beacon beside the "
    "runway, and from radio altitude. No GNSS and no ILS are used. ± holds 95 % of the errors of one axis."
)
HOW = (
    "How computed: three bearings give the distances along and right of the course and the heading off it, so that "
    "crab cancels. Height above the glide path is radio altitude minus threshold crossing height minus distance times "
    "the tangent of the glide angle. Near the circle through the three beacons, which crosses the course at the "
    "locators, bearings give no position."
)
APPROACH_HEADS = (
    *(Head("Approach"), Head("Flight time"), Head("From, m", True), Head("To, m", True), Head("Positions", True)),
    *(Head("No position", True), Head("Closing speed, m/s", True), Head("Ground speed, m/s", True)),
    *(Head("Heading − INS, °", True), Head("Terrain, m", True)),
)
APPROACH_CAPTION = (
    "From and to: distance before the threshold. Ground speed and heading of the INS show whether bearings and "
    "beacons belong together; terrain: rise and fall of the ground under the approach that the site file does not "
    "hold."
)
ROW_HEADS = (
    *(Head("Approach"), Head("Before the threshold, m", True), Head("Right of course, m", True)),
    *(Head("Above glide path, m", True), Head("Lateral accuracy"), Head("Vertical accuracy")),
)
ROW_CAPTION = (
    "Means over one second; ±: error of a single mean. Accuracy: the most demanding category whose 95 % figure is "
    "met; those of CAT II and III are ILS look-alike values."
)


def landing_beacons(results: FlightResults) -> Section | None:
    """Return the chapter; None where no bearings were logged.

    Where bearings were logged but gave no answer, the chapter says why.
    """
    answer = results.answer(BeaconLanding)
    if answer is None:
        return without_answer(results, BeaconLanding.analysis, TITLE, LEAD)
    parts: tuple[Part | None, ...] = (
        Grid("Approaches", APPROACH_HEADS, [_approach(row) for row in answer.approaches], APPROACH_CAPTION),
        Figure("landing_beacons.deviations"),
        Grid("Deviations", ROW_HEADS, [_deviation(row) for row in answer.rows], ROW_CAPTION, ("landing_beacons_path",)),
        _beacons(answer),
        *(Note(sentence(remark)) for remark in answer.remarks),
    )
    workings = kept((Note(HOW), setting_facts(answer.settings, "landing_beacons")))
    headline = _headline(answer)
    told = Claim(Rank.LANDING, Mark("good", "Measured"), headline, remark=headline)
    return Section("landing_beacons", TITLE, LEAD, kept(parts), headline, claim=told, appendix=workings)


def _headline(answer: BeaconLanding) -> str:
    count = len(answer.approaches)
    told = f"{counted(count, 'approach', 'approaches')} to {answer.runway}"
    if not answer.rows:
        return told
    row = answer.rows[-1]
    lateral, glide = _with(row.lateral_m, row.lateral_95_m), _with(row.glide_path_m, row.glide_path_95_m)
    where = f"{number(row.before_threshold_m, 0, 'm')} before the threshold"
    above = "" if row.glide_path_m is None else f", {glide} m above glide path"
    return f"{told}; {where} {lateral} m right of course{above}"


def _with(value: float | None, half: float | None) -> str:
    if value is None or half is None:
        return ABSENT
    return f"{number(value, 1, signed=True)} ± {number(half, 1)}"


def _approach(row: BeaconApproachRow) -> tuple[Cell, ...]:
    return (
        str(row.approach),
        f"{clock(row.start_s)} – {clock(row.end_s)}",
        number(row.first_before_threshold_m, 0),
        number(row.last_before_threshold_m, 0),
        number(row.fixes, 0),
        number(row.blind, 0),
        number(row.speed_mps, 1),
        number(row.ground_speed_mps, 1),
        number(row.heading_difference_deg, 1, signed=True),
        number(row.terrain_m, 1),
    )


def _deviation(row: DeviationRow) -> tuple[Cell, ...]:
    return (
        str(row.approach),
        number(row.before_threshold_m, 0),
        _with(row.lateral_m, row.lateral_95_m),
        _with(row.glide_path_m, row.glide_path_95_m),
        row.lateral_category or ABSENT,
        row.vertical_category or ABSENT,
    )


def _beacons(answer: BeaconLanding) -> Grid:
    heads = (Head("Beacon"), Head("Before the threshold, m", True), Head("Right, m", True), Head("Bearings", True))
    rows = [
        (row.name, number(row.before_threshold_m, 0), number(row.right_m, 0, signed=True), number(row.bearings, 0))
        for row in answer.beacons
    ]
    caption = (
        f"Assumed: {number(answer.bearing_sigma_deg, 1, '°')} of bearing and {number(answer.height_sigma_m, 1, 'm')} "
        "of radio altitude, one σ, independent from sample to sample."
    )
    return Grid("Beacons", heads, rows, caption)
