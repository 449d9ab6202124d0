"""Chapter: the magnetic deviation that flights found, those of one aircraft beside each other."""

from typing import Any

import numpy as np

from groundstation.chapters.magnetic import TONES
from groundstation.chapters.parts import Cell, Grid, Head, Mark, Part, Section
from groundstation.chapters.wording import ABSENT, number
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.fleet.common import aircraft_name, bounded, colours_of
from groundstation.results.fleet import DeviationRow, FleetResults
from groundstation.results.magnetic import ADVISORY, LETTERS, METHOD_TITLES

TITLE = "Magnetic deviation by aircraft"
LEAD = "What each flight found with its figure-eight: does the deviation of an aircraft stay the same?"
MOST_CURVES = 60
METHODS = {str(name): title for name, title in METHOD_TITLES.items()}
CHANGED = 3.0  # times what the sigmas lead to expect


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None where no flight found a deviation."""
    if not fleet.deviations:
        return None
    usable = [row for row in fleet.deviations if row.verdict != "reject"]
    parts: list[Part] = [_curves(fleet, usable)] if usable else []
    return Section("deviation", TITLE, LEAD, (*parts, _table(fleet.deviations)))


def _curves(fleet: FleetResults, rows: list[DeviationRow]) -> Drawing:
    shown, colours = rows[:MOST_CURVES], colours_of(fleet)
    heading_deg = np.arange(0.0, 361.0, 2.0)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 136, 62)
        named: set[str] = set()
        for row in shown:
            label = None if row.aircraft in named else d.label(aircraft_name(row.aircraft), 20)
            named.add(row.aircraft)
            axes.plot(
                heading_deg,
                row.error_deg(heading_deg),
                color=colours[row.aircraft],
                linewidth=1.1,
                alpha=0.8,
                label=label,
            )
        axes.axhline(0.0, color=d.FAINT, linewidth=0.6)
        axes.set_xlim(0.0, 360.0)
        axes.set_xticks(np.arange(0, 361, 45))
        axes.set_xlabel("uncorrected magnetic heading, °")
        axes.set_ylabel("error, °")
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), labelspacing=0.7)

    more = f" The first {MOST_CURVES} of {number(len(rows), 0)}." if len(rows) > MOST_CURVES else ""
    caption = f"A to E of each flight, level, declination removed; rejected flights are left out.{more}"
    alt = "Error of the magnetic heading against heading, a curve for each flight, coloured by aircraft."
    return Drawing("Error of every flight", caption, alt, d.draw("fleet-deviation", 70, paint))


def _table(rows: tuple[DeviationRow, ...]) -> Grid:
    heads = (
        *(Head("Aircraft"), Head("Flight"), Head("Verdict"), Head("Method")),
        *(Head(f"{letter}, °", True) for letter in LETTERS),
        *(Head("After, °", True), Head("Others", True), Head("Differs, °", True), Head("Expected, °", True)),
    )
    caption = (
        "Error = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading. After: RMS in level "
        "flight no fit has seen, after correction. Differs: RMS over the circle of the difference from the mean of the "
        "aircraft's other flights; expected: what the standard deviations lead to where nothing changed; marked where "
        f"it is more than {CHANGED:g} times that. {ADVISORY}"
    )
    return Grid("Deviation of every flight", heads, [_cells(row) for row in rows], caption)


def _cells(row: DeviationRow) -> tuple[Cell, ...]:
    difference, expected = row.difference_rms_deg, row.expected_rms_deg
    is_changed = difference is not None and expected is not None and difference > CHANGED * expected
    text = bounded(difference, 2)
    return (
        aircraft_name(row.aircraft),
        row.flight_id,
        Mark(TONES.get(row.verdict, "unknown"), row.verdict),
        METHODS.get(row.method, row.method),
        *(bounded(row.coefficients_deg[letter], 2, signed=True) for letter in LETTERS),
        bounded(row.after_rms_deg, 2),
        number(row.others, 0) if row.others else ABSENT,
        Mark("warn", text) if is_changed else text,
        bounded(expected, 2),
    )
