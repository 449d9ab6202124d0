"""What every plot of simulated flights shows, in a line a mark: ``python -m tests.plot_contents`` writes it anew.

A mark's line has its role, name and look, and of each of its arrays in brackets the number of values that are known,
the least, the greatest and their mean. What a change of a description does to the plots is a diff of
``references/plots.json``; :func:`differences` compares with tolerance, for the last digits are those of a machine.
"""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from groundstation.chapters.parts import Figure
from groundstation.chapters.plots.comparison import sides_of
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.verbs.compare import compare
from groundstation.plots.marks import AnyMark
from groundstation.plots.plot import Axis, Panel, Plot
from groundstation.reports.drawing import plot_of
from groundstation.results.files import save
from groundstation.results.flight import FlightResults
from groundstation.results.manifest import Manifest
from groundstation.systems import systems
from tests import plot_cases, viewer_example
from tests.saved import load
from tests.told import COMPARED, PLOTS

Contents = dict[str, dict[str, list[str]]]  # lines by plot and panel
KEPT = Path(__file__).parent / "references" / "plots.json"
SAMPLES = Path(__file__).parents[1] / "sample_logs"
RUN = ("taxi-good", "taxi-short")  # logs that the suite runs anyway
SAVED = (
    "report",
    "aided",
    "units",
    "causes",
    "magnetic",
    "ground",
    "flux",
    "landing",
    "beacons",
    "control",
    "placement",
    "session",
    "trajectory",
)
ALIKE = 1e-4  # of the greatest number in the brackets: what another machine may come to
MOST_STATES = 8
BRACKETS = re.compile(r"\[([^\[\]]*)\]")


def of_flight(results: FlightResults) -> Contents:
    """Contents of every plot of a flight."""
    told: Contents = {}
    for name, tell in PLOTS.items():
        describe: Any = tell
        for of in plot_cases.names_of(name, results):
            plot = describe(results, *of)
            if plot is not None:
                told[".".join((name, *of))] = _panels(plot)
    return told


def of_comparison() -> Contents:
    """Contents of the plots of two flights, the second shorter, its clock moved."""
    with TemporaryDirectory() as folder:
        for name, duration_s in (("a", 240.0), ("b", 200.0)):
            flight = viewer_example.make_flight(duration_s, 20.0)
            save(Path(folder, name), viewer_example.make_results(flight), Manifest())
        sides = sides_of(*compare(Path(folder, "a"), Path(folder, "b"), "start"))
        plots = {name: tell(sides) for name, tell in COMPARED.items()}
    return {name: _panels(plot) for name, plot in plots.items() if plot is not None}


def of_fleet() -> Contents:
    """Contents of the plots of three aircraft, one of which changes."""
    from tests.reports.test_fleet_report import fleet_of

    fleet = fleet_of(60)
    sections = (one.build(fleet) for one in systems().fleet_chapters)
    figures = [part for section in sections if section is not None for part in section.parts]
    told: Contents = {}
    for one in figures:
        if isinstance(one, Figure) and (plot := plot_of(systems().fleet_plots, one, fleet)) is not None:
            told[".".join(filter(None, (one.name, one.of)))] = _panels(plot)
    return told


CASES: dict[str, Callable[[], Contents]] = {
    **{name: (lambda name=name: of_flight(plot_cases.CASES[name]())) for name in SAVED},
    "comparison": of_comparison,
    "fleet": of_fleet,
}


def _panels(plot: Plot) -> dict[str, list[str]]:
    return {f"{place} {_title(panel)}": _lines(panel) for place, panel in enumerate(plot.panels)}


def _title(panel: Panel) -> str:
    return " | ".join(filter(None, (panel.title, panel.y.title, panel.x.title, panel.nothing)))


def _lines(panel: Panel) -> list[str]:
    return [f"x {_axis(panel.x)}", f"y {_axis(panel.y)}", *(" ".join(_mark(mark)) for mark in panel.marks)]


def _axis(axis: Axis) -> str:
    ends = [end for end in (axis.low, axis.high) if end is not None]
    windows = [end for window in (*axis.windows, *axis.ranges) for end in window]
    names = [name for _, name in axis.names]
    return " ".join(filter(None, (axis.scale, _bracket(ends), windows and _bracket(windows), names and str(names))))


def _mark(mark: AnyMark) -> Iterator[str]:
    yield type(mark).__name__
    yield mark.role
    yield repr(mark.name)
    for one in fields(mark):
        value = getattr(mark, one.name)
        if one.name in ("role", "name") or (one.default is not MISSING and value == one.default):
            continue
        if one.name == "rings":
            yield f"rings {len(value)} {_array(np.concatenate([np.zeros(0), *(ring.ravel() for ring in value)]))}"
        elif isinstance(value, np.ndarray):
            yield f"{one.name} {_array(value) if value.dtype.kind == 'f' else _states(value)}"
        elif isinstance(value, float | tuple) and not isinstance(value, bool) and value != ():
            yield f"{one.name} {_value(value)}"
        elif value not in ((), {}):
            yield f"{one.name} {value}"


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return _bracket(list(value)) if isinstance(value[0], float) else str(list(value[:MOST_STATES]))
    return _bracket([value])


def _array(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return f"{known.size} {_bracket([known.min(), known.max(), known.mean()] if known.size else [])}"


def _states(values: np.ndarray) -> str:
    return f"{len(values)} {', '.join(list(dict.fromkeys(values.tolist()))[:MOST_STATES])}"


def _bracket(values: list[float]) -> str:
    return f"[{' '.join(f'{value:.6g}' for value in values)}]" if values else ""


def differences(found: Contents, kept: Contents) -> list[str]:
    """Lines of which one has another than the other; numbers in brackets may differ a little."""
    told = []
    for plot in sorted({*found, *kept}):
        ours, theirs = (one.get(plot, {}) for one in (found, kept))
        for panel in sorted({*ours, *theirs}):
            now, then = ours.get(panel, []), theirs.get(panel, [])
            for place in range(max(len(now), len(then))):
                pair = [one[place] if place < len(one) else "nothing" for one in (now, then)]
                if not _is_alike(*pair):
                    told.append(f"{plot}, {panel}: {pair[0]} | kept: {pair[1]}")
    return told


def _is_alike(one: str, other: str) -> bool:
    if BRACKETS.sub("[]", one) != BRACKETS.sub("[]", other):
        return False
    return all(map(_are_near, BRACKETS.findall(one), BRACKETS.findall(other)))


def _are_near(one: str, other: str) -> bool:
    if one == other:
        return True
    try:
        ours, theirs = (np.array(text.split(), dtype=np.float64) for text in (one, other))
    except ValueError:  # names of rows
        return False
    if ours.shape != theirs.shape:
        return False
    size = max(float(np.abs(np.concatenate([ours, theirs])).max(initial=0.0)), 1e-9)
    return bool((np.abs(ours - theirs) <= ALIKE * size).all())


def main() -> None:
    """Write all contents."""
    told = {name: tell() for name, tell in CASES.items()}
    with TemporaryDirectory() as folder:
        for name in RUN:
            (outcome,) = run_many([SAMPLES / f"{name}.csv"], Path(folder, name), Configuration(), jobs=1)
            told[name] = of_flight(load(Path(outcome.folder)).results)
    KEPT.write_text(json.dumps(told, ensure_ascii=False, indent=0, sort_keys=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
