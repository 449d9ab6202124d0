"""Plots of several units: error of each, difference of each pair."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.plots.common import has_values, span
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import AnyMark, Curve, Floats, Texts, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row
from groundstation.plots.ranges import finite
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.units_answer import UnitsResult
from groundstation.systems.inertial.units_arrays import UnitsErrors, UnitsPairs

PANEL_MM = 60.0
TITLES = {
    ("errors", "radial"): ("Radial error of each unit", "radial error, m"),
    ("errors", "velocity"): ("Velocity error of each unit", "velocity error, m/s"),
    ("pairs", "radial"): ("Distance of each pair", "distance, m"),
    ("pairs", "velocity"): ("Velocity difference of each pair", "velocity difference, m/s"),
    ("pairs", "heading"): ("Heading difference of each pair", "heading difference, °"),
}


def radial(results: FlightResults) -> Plot | None:
    """Return the radial error of each unit, without a reference the pairs' distances."""
    return _of_units(results, "radial", "units.radial") or _of_pairs(results, "radial", "units.radial")


def errors(results: FlightResults, quantity: str) -> Plot | None:
    """Return the error of each unit in ``radial`` position or ``velocity``."""
    return _of_units(results, quantity, f"units.errors.{quantity}")


def pairs(results: FlightResults, quantity: str) -> Plot | None:
    """Return the difference of each pair in ``radial`` position, ``velocity`` or ``heading``."""
    return _of_pairs(results, quantity, f"units.pairs.{quantity}")


def _of_units(results: FlightResults, quantity: str, name: str) -> Plot | None:
    data, answer = results.rows_of(UnitsErrors), results.answer(UnitsResult)
    if data is None or answer is None:
        return None
    values = {"radial": data.radial_m, "velocity": data.velocity_mps}.get(quantity)
    if values is None:
        return None
    says = f"Each unit against {answer.against_title}."
    return _plot(data.unit, data.time_s, values, ("errors", quantity), name, says, "units_errors")


def _of_pairs(results: FlightResults, quantity: str, name: str) -> Plot | None:
    data = results.rows_of(UnitsPairs)
    if data is None:
        return None
    values = {"radial": data.radial_m, "velocity": data.velocity_mps, "heading": data.heading_deg}.get(quantity)
    if values is None:
        return None
    says = "The second unit less the first, of every pair."
    return _plot(data.pair, data.time_s, values, ("pairs", quantity), name, says, "units_pairs")


def _plot(
    names: Texts, time_s: Floats, values: Floats, of: tuple[str, str], name: str, says: str, arrays: str
) -> Plot | None:
    if not has_values(values):
        return None
    marks: list[AnyMark] = []
    for place, one in enumerate(dict.fromkeys(names.tolist())):
        mine = names == one
        if np.isfinite(values[mine]).any():
            marks.append(Curve(x=time_s[mine], y=values[mine], role=series(place), name=one))
    title, axis = TITLES[of]
    known = finite(values)
    is_signed = of[1] == "heading"
    y = Axis(axis) if is_signed else Axis(axis, low=0.0, high=1.05 * float(known.max()) or 1.0)
    panel = Panel([*marks, ZERO] if is_signed else marks, time_axis(*span(time_s)), y, legend="above")
    return Plot(name, title, says, f"{title} over flight time.", (Row((panel,), PANEL_MM),), (arrays,))


PLOTS: Mapping[str, Describe] = {"units.radial": radial, "units.errors": errors, "units.pairs": pairs}
