"""Part of the session's chapter on its ground stations."""

from groundstation.chapters.parts import Grid, Head, Mark, Part, Tone
from groundstation.chapters.wording import named_quantity, number
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.stations_answer import StationRow, StationsAnswer, digits_of

STATION_HEADS = (
    *(Head("Station"), Head("Judged"), Head("Ranges", True), Head("Chance if right", True)),
    *(Head("Shift if it is off, m", True), Head("Towards, deg", True), Head("Delay if that is off, m", True)),
    *(Head("Sigma stated, m", True), Head("Sigma used, m", True)),
)
STATION_CAPTION = (
    "Shift: from the place in the stations file to where the ranges put the station if it alone is off, one sigma "
    "behind it. Delay: by how much its ranges are too long if that alone is wrong. Sigma: of its place, as the file "
    "states it and as the answer takes it."
)
RELIABILITY_HEADS = (
    *(Head("Station"), Head("Detectable shift, m", True), Head("Answer's metres per metre", True), Head("Most of")),
    Head("Surveyed north, east, m", True),
)
RELIABILITY_CAPTION = (
    "Detectable: the smallest shift that is found with 95 %, best to worst direction. Metres per metre: by how much a "
    "metre of shift moves the smoothed answer, worst direction, aircraft and time. Surveyed: where the answer puts a "
    "station whose place is not taken as exact, off the file, with sigmas."
)
PROTECTION_HEADS = (Head("Aircraft"), Head("Worst, m", True), Head("At the end, m", True))
PROTECTION_CAPTION = (
    "Bound of the smoothed answer's error while one station is off by as much as the test finds with 95 %: the effect "
    "of that shift and 1.96 sigma."
)
DATUM_HEADS = (
    *(Head("Datum of the stations file"), Head("Shift, m", True), Head("Evidence", True), Head("Could be told")),
    Head("Judged"),
)
DATUM_CAPTION = (
    "Evidence: twice the log of the likelihood ratio against WGS-84; above 12 the datum is told. Could be told: the "
    "session would show it."
)
NUMBERS = ("cooperative_stations",)
TONES: dict[str, Tone] = {
    "fits": "good",
    "off": "bad",
    "one of several": "warn",
    "left out": "bad",
    "not judged": "unknown",
}


def stations_warning(answer: CooperativeResult) -> str:
    """Return what the page opens with where stations are in doubt; empty where none is."""
    stations = answer.stations
    if stations is None:
        return ""
    said = []
    told = sorted((row for row in stations.datums if row.is_told), key=lambda row: -row.evidence)
    if told:
        names = " or ".join(row.datum for row in told)
        said.append(f"Stations look to be in {names}, not in WGS-84; the answer takes them as {told[0].datum}.")
    for row in stations.with_verdict("off"):
        said.append(
            f"Station {row.station} is {_size(row)} off its place in the stations file; the answer takes its place as "
            f"unknown by {number(row.used_sigma_m, digits_of(row.used_sigma_m), 'm')}."
        )
    several, late = stations.with_verdict("one of several"), stations.with_verdict("left out")
    if len(several) == 1 and late:
        said.append(
            f"Station {several[0].station} is {_size(several[0])} off its place in the stations file, or ranges of "
            f"station {', '.join(row.station for row in late)} are off by a delay: the session does not tell which, "
            "and the answer relies on none of them."
        )
    elif several:
        names = ", ".join(row.station for row in several)
        said.append(
            f"Stations {names} contradict each other by {_size(several[0])}: the session does not tell which is off, "
            "and the answer relies on the place of none of them."
        )
    for row in late:
        said.append(
            f"Ranges of station {row.station} are off by "
            f"{number(row.delay_m, digits_of(row.delay_m), 'm', signed=True)} (clock or delay); "
            "the answer does not use them."
        )
    return " ".join(said)


def stations_parts(answer: CooperativeResult) -> tuple[Part | None, ...]:
    """Return the parts on the stations; none in a session without any."""
    stations = answer.stations
    if stations is None:
        return ()
    return (_stations(stations), _reliability(stations), _protection(stations), _datums(stations))


def _size(row: StationRow) -> str:
    digits = digits_of(row.shift_m)
    half = None if row.shift_sigma_m is None else 1.96 * row.shift_sigma_m
    return f"{number(row.shift_m, digits, 'm')} ± {number(half, digits)}"


def _stations(stations: StationsAnswer) -> Grid:
    rows = [
        (
            row.station,
            Mark(TONES[row.verdict], row.verdict),
            number(row.ranges, 0),
            _chance(row),
            _with_sigma(row.shift_m, row.shift_sigma_m),
            number(row.shift_direction_deg, 0),
            _with_sigma(row.delay_m, row.delay_sigma_m, signed=True),
            number(row.stated_sigma_m, digits_of(row.stated_sigma_m) or 1),
            "not used" if row.verdict == "left out" else number(row.used_sigma_m, digits_of(row.used_sigma_m) or 1),
        )
        for row in stations.rows
    ]
    return Grid("Ground stations", STATION_HEADS, rows, STATION_CAPTION + _tested_with(stations), NUMBERS)


def _chance(row: StationRow) -> str:
    if row.verdict == "not judged":
        return ""
    return "below 0.0001" if row.chance < 1e-4 else number(row.chance, 4)


def _tested_with(stations: StationsAnswer) -> str:
    raised = [f"{named_quantity(name)[0]} {number(by, 1)} times" for name, by in stations.raised.items()]
    said = f" Tested with sigmas as large as the session shows them: {', '.join(raised)} the stated." if raised else ""
    if stations.repetition > 1.0:
        said += f" Readings repeat themselves: {number(stations.repetition, 1)} count as one."
    return said


def _reliability(stations: StationsAnswer) -> Grid:
    rows = [
        (row.station, _best_to_worst(row), number(row.metres_per_metre, 2), row.moves_most, _surveyed(row))
        for row in stations.rows
    ]
    return Grid("Errors of stations that stay unseen", RELIABILITY_HEADS, rows, RELIABILITY_CAPTION, NUMBERS)


def _with_sigma(value: float | None, sigma: float | None, *, signed: bool = False) -> str:
    return (
        ""
        if value is None or sigma is None
        else f"{number(value, digits_of(value), signed=signed)} ± {number(sigma, digits_of(sigma))}"
    )


def _best_to_worst(row: StationRow) -> str:
    if row.detectable_best_m is None:
        return "none"
    worst = (
        "none" if row.detectable_worst_m is None else number(row.detectable_worst_m, digits_of(row.detectable_worst_m))
    )
    return f"{number(row.detectable_best_m, digits_of(row.detectable_best_m))} to {worst}"


def _surveyed(row: StationRow) -> str:
    if row.survey_north_m is None:
        return ""
    north = _with_sigma(row.survey_north_m, row.survey_sigma_north_m, signed=True)
    return f"{north}, {_with_sigma(row.survey_east_m, row.survey_sigma_east_m, signed=True)}"


def _protection(stations: StationsAnswer) -> Grid:
    rows = [
        (row.vehicle, number(row.worst_m, digits_of(row.worst_m)), number(row.end_m, digits_of(row.end_m)))
        for row in stations.protection
    ]
    return Grid("Protection level", PROTECTION_HEADS, rows, PROTECTION_CAPTION)


def _datums(stations: StationsAnswer) -> Grid | None:
    if not stations.datums:
        return None
    rows = [
        (
            row.datum,
            number(row.shift_m, 0),
            number(row.evidence, 1, signed=True),
            "yes" if row.is_decidable else "no",
            Mark("warn", "told") if row.is_told else Mark("plain", "not told"),
        )
        for row in stations.datums
    ]
    return Grid("Datum of the stations", DATUM_HEADS, rows, DATUM_CAPTION)
