"""Plots of the comparison with a reference.

Errors in the band claimed, plan view, claimed against seen.
"""

from collections.abc import Mapping

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import label
from groundstation.chapters.wording import MINUS
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Emphasis, Floats, Intervals, Limit, Role
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_gaps, finite, padded
from groundstation.results.flight import FlightResults
from groundstation.systems.reference.answer import ReferenceResult, title_of
from groundstation.systems.reference.arrays import ReferenceErrors, ReferenceTrack

ROLES: dict[str, Role] = {"reference": "truth", "gnss": "gnss", "ins": "ins", "smoothed": "series 4"}
STATE_ROLES: dict[str, Role] = {"too_sure": "bad", "consistent": "answer"}
PANEL_MM, ROW_MM = 26.0, 6.0
BAND_SEEN = 3.0  # a band may make an axis so many times as long as its errors do
LARGEST_IN_METRES = 3000.0


def role_of(subject: str) -> Role:
    """Return the role of a subject; the corrected INS is the answer."""
    return ROLES.get(subject.partition(".")[0], "answer")


def errors(results: FlightResults, of: str) -> Plot | None:
    """Return errors of one subject and quantity over time, in their claimed 95 % band.

    The band that subject and reference claim together.
    """
    subject, _, quantity = of.partition(" ")
    data = results.rows_of(ReferenceErrors)
    if data is None:
        return None
    own = data.where(data.subject == subject)
    axes = [axis for axis in _error_axes(own, quantity) if np.isfinite(axis.error).any()]
    if not axes:
        return None
    panels = [_panel(own.time_s, axis, role_of(subject), legend=axis is axes[0]) for axis in axes]
    has_band = any(np.isfinite(axis.half).any() for axis in axes)
    claimed = "Shaded: the 95 % that it and the reference claim together." if has_band else "It claims no σ."
    name = title_of(subject)
    return Plot(
        f"reference.errors.{of}",
        f"{name}: {quantity} against the reference",
        f"{name} {MINUS} reference. {claimed}",
        f"Errors of {name} in {quantity} against the reference over flight time.",
        tuple(Row((panel,), PANEL_MM, shares_x=panel is not panels[-1]) for panel in panels),
        ("reference_errors",),
    )


@dataclass(frozen=True)
class ErrorAxis:
    """Errors along one axis, its title, and half of the 95 % that are claimed."""

    title: str
    error: Floats
    half: Floats


def _error_axes(data: ReferenceErrors, quantity: str) -> tuple[ErrorAxis, ...]:
    """Return the axes of a quantity; a sigma claimed of several axes is shared among them."""
    if quantity == "position":
        across = NORMAL_95 / np.sqrt(2.0) * data.horizontal_sigma_m
        return (
            ErrorAxis("north, m", data.north_error_m, across),
            ErrorAxis("east, m", data.east_error_m, across),
            ErrorAxis("up, m", data.up_error_m, NORMAL_95 * data.vertical_sigma_m),
        )
    if quantity == "velocity":
        across = NORMAL_95 / np.sqrt(2.0) * data.velocity_sigma_mps
        return (
            ErrorAxis("north, m/s", data.north_error_mps, across),
            ErrorAxis("east, m/s", data.east_error_mps, across),
        )
    return (
        ErrorAxis("roll, °", data.roll_error_deg, NORMAL_95 * data.roll_sigma_deg),
        ErrorAxis("pitch, °", data.pitch_error_deg, NORMAL_95 * data.pitch_sigma_deg),
        ErrorAxis("heading, °", data.heading_error_deg, NORMAL_95 * data.true_heading_sigma_deg),
    )


def _panel(time: Floats, axis: ErrorAxis, role: Role, *, legend: bool) -> Panel:
    moments, line, half = broken_at_gaps(time, axis.error, axis.half)
    marks: list[AnyMark] = [ZERO]
    if np.isfinite(half).any():
        marks.append(Band(x=moments, low=-half, high=half, role="faint", name="95 % claimed"))
    marks.append(Curve(x=moments, y=line, role=role, name="error"))
    shown, claimed = finite(axis.error), finite(axis.half)
    reach = float(np.abs(shown).max())
    most = min(float(claimed.max()), BAND_SEEN * reach) if claimed.size else 0.0
    low, high = padded(min(float(shown.min()), -most), max(float(shown.max()), most), 0.08)
    ends = time_axis(float(time.min()), float(time.max()))
    return Panel(marks, ends, Axis(axis.title, low=low, high=high), legend="above" if legend else "")


def track(results: FlightResults) -> Plot | None:
    """Plan view of the reference and of every subject."""
    data = results.rows_of(ReferenceTrack)
    if data is None:
        return None
    north, east = data.place_north_m, data.place_east_m
    known = finite(north, east)
    if not known.size:
        return None
    scale, unit = (1e-3, "km") if float(np.ptp(known)) > LARGEST_IN_METRES else (1.0, "m")
    marks = []
    for name in sorted(dict.fromkeys(data.subject.tolist()), key=lambda name: name != "reference"):
        mine, is_reference = data.subject == name, name == "reference"
        title = "reference" if is_reference else title_of(name)
        heavy: Emphasis = "bold" if is_reference else "usual"
        x, y = scale * east[mine], scale * north[mine]
        marks.append(Curve(x=x, y=y, role=role_of(name), name=title, emphasis=heavy))
    panel = Panel(marks, Axis(f"east, {unit}"), Axis(f"north, {unit}"), is_map=True)
    return Plot(
        "reference.track",
        "Plan view",
        "Origin: where the reference begins. All position errors are shown, constant ones too.",
        "Plan view of the reference and of what was recorded and estimated.",
        one_panel(panel, 80.0),
        ("reference_track",),
    )


def claims(results: FlightResults) -> Plot | None:
    """Return the share of the errors inside the 95 % claimed, with its interval."""
    answer = results.answer(ReferenceResult)
    if answer is None or not answer.claims:
        return None
    rows = answer.claims
    marks: list[AnyMark] = [Limit(value=95.0, is_upright=True)]
    for place, row in enumerate(rows):
        low, high = row.confidence95
        role = STATE_ROLES.get(row.state, "faint")
        marks.append(
            Intervals(row=place, value=100.0 * row.share_inside95, thick=(100.0 * low, 100.0 * high), role=role)
        )
    names = tuple((float(place), _name(row.subject, row.quantity, row.axis)) for place, row in enumerate(rows))
    x = Axis("seen inside the 95 % claimed, %", low=-2.0, high=102.0)
    panel = Panel(marks, x, Axis(low=len(rows) - 0.5, high=-0.5, names=names), legend="")
    return Plot(
        "reference.claims",
        "Claimed against seen",
        "Dot: share of the errors inside the 95 % that subject and reference claim together; bar: its 95 % interval by "
        "the number of independent samples. Green is consistent with the dashed 95 %, red too sure, grey cannot be "
        "judged or is too careful.",
        "Share of the errors inside the claimed 95 % with intervals, one row for each claim.",
        one_panel(panel, 2.0 + ROW_MM * len(rows)),
    )


def _name(subject: str, quantity: str, axis: str) -> str:
    return label(f"{title_of(subject)}, {axis if quantity == 'attitude' else f'{quantity} {axis}'}", 44)


PLOTS: Mapping[str, Describe] = {
    "reference.errors": errors,
    "reference.track": track,
    "reference.claims": claims,
}
