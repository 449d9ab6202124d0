"""Chapter on the magnetic deviation found in flights, by aircraft."""

from groundstation.chapters.fleet.common import aircraft_name, bounded
from groundstation.chapters.parts import Cell, Figure, Grid, Head, Mark, Part, Section
from groundstation.chapters.wording import ABSENT, number
from groundstation.results.fleet import FleetDeviationRow, FleetResults
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import ADVISORY, METHOD_TITLES
from groundstation.systems.magnetic.chapter import TONES
from groundstation.systems.magnetic.flux_answer import FLUX_TITLES

TITLE = "Magnetic deviation by aircraft"
LEAD = "What each flight found with its figure-eight or its legs: does the deviation of an aircraft stay the same?"
SENSORS = {"magnetic": "magnetometer", "flux": "heading alone"}
METHODS = {str(name): title for name, title in (*METHOD_TITLES.items(), *FLUX_TITLES.items())}
CHANGED = 3.0  # times what the sigmas lead to expect


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None where no flight found a deviation."""
    if not fleet.deviations:
        return None
    parts: list[Part] = [Figure("fleet.deviation")] if usable(fleet) else []
    return Section("deviation", TITLE, LEAD, (*parts, _table(fleet.deviations)))


def usable(fleet: FleetResults) -> list[FleetDeviationRow]:
    """Return the deviations of the flights that are not rejected."""
    return [row for row in fleet.deviations if row.verdict != "reject"]


def _table(rows: tuple[FleetDeviationRow, ...]) -> Grid:
    heads = (
        *(Head("Aircraft"), Head("Flight"), Head("Sensor"), Head("Verdict"), Head("Method")),
        *(Head(f"{letter}, °", True) for letter in LETTERS),
        *(Head("After, °", True), Head("Others", True), Head("Differs, °", True), Head("Expected, °", True)),
    )
    caption = (
        "Error = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading. After: RMS in level "
        "flight that no fit used, after correction; of a compass of heading alone, on legs by the other directions. "
        "Differs: RMS over the circle of the difference from the mean of the aircraft's other flights with that "
        "sensor; expected: from the standard deviations if nothing changed; marked where it is more than "
        f"{CHANGED:g} times that. {ADVISORY}"
    )
    return Grid("Deviation of every flight", heads, [_cells(row) for row in rows], caption)


def _cells(row: FleetDeviationRow) -> tuple[Cell, ...]:
    difference, expected = row.difference_rms_deg, row.expected_rms_deg
    is_changed = difference is not None and expected is not None and difference > CHANGED * expected
    text = bounded(difference, 2)
    return (
        aircraft_name(row.aircraft),
        row.flight_id,
        SENSORS.get(row.sensor, row.sensor),
        Mark(TONES.get(row.verdict, "unknown"), row.verdict),
        METHODS.get(row.method, row.method),
        *(bounded(row.coefficients_deg[letter], 2, signed=True) for letter in LETTERS),
        bounded(row.after_rms_deg, 2),
        number(row.others, 0) if row.others else ABSENT,
        Mark("warn", text) if is_changed else text,
        bounded(expected, 2),
    )
