"""Chapter: whether stated sigmas are honest, by independent checks over all flights."""

from groundstation.chapters.fleet.chapter import KeyFigure
from groundstation.chapters.parts import Figure, Grid, Head, Mark, Note, Section
from groundstation.chapters.wording import number, percent, typeset
from groundstation.results.fleet import FleetCalibration, FleetResults

LEAD = "Are the stated intervals honest? 95 % of the independent checks should lie inside."


def build(fleet: FleetResults) -> Section:
    """Build the chapter."""
    title = "Calibration"
    if not fleet.calibration:
        text = "No flight has an independent check of its answers."
        return Section("calibration", title, LEAD, (Note(text, "unknown"),))
    return Section("calibration", title, LEAD, (Figure("fleet.calibration"), _table(fleet)))


def figures(fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return the share inside of the first kind of check."""
    if not fleet.calibration:
        return ()
    first = fleet.calibration[0]
    remark = f"inside the stated 95 %: {first.title}"
    return (("Calibration", f"{first.inside} of {first.checks}", f"{remark} ({percent(first.share_inside, 0)})"),)


def has_checks(fleet: FleetResults) -> bool:
    """Tell whether any answer was checked."""
    return bool(fleet.calibration)


def judged(row: FleetCalibration) -> Mark:
    """Tell whether the stated share lies in the interval of the share found."""
    low, high = row.confidence95
    if high < row.stated:
        return Mark("warn", "too sure")
    return Mark("plain", "too careful") if low > row.stated else Mark("good", "consistent")


def _table(fleet: FleetResults) -> Grid:
    heads = (
        *(Head("Check"), Head("Checks", True), Head("Inside", True), Head("Share", True)),
        *(Head("95 % interval", True), Head("Mean of z", True), Head("σ of z", True), Head("Sigmas are")),
    )
    rows = [
        (
            *(typeset(row.title), number(row.checks, 0), number(row.inside, 0), percent(row.share_inside, 1)),
            " … ".join(percent(bound, 1) for bound in row.confidence95),
            *(number(row.z_mean, 2, signed=True), number(row.z_sigma, 2), judged(row)),
        )
        for row in fleet.calibration
    ]
    caption = (
        "z: residual over its stated sigma; mean 0 and σ 1 are honest. For the heading, flights with the verdict "
        "reject are left out. The value found on board uses the same samples: expect more than 95 % inside. Positions "
        "by a reference: each flight counts with its number of independent samples."
    )
    return Grid("Checks", heads, rows, caption)
