"""Rerun recording of a fleet: fleet.rrd, with one row per flight.

Its timelines are ``utc`` and ``flight_number``.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.chapters.plots.fleet.trend import HEADING
from groundstation.results.fleet import FleetResults
from groundstation.systems.system import Systems
from groundstation.viewer.fleet_charts import (
    MOST_AIRCRAFT,
    ChartedAircraft,
    aircraft_of,
    by_aircraft,
    is_judged,
    log_aircraft,
    verdicts,
)
from groundstation.viewer.fleet_density import heading_error_density
from groundstation.viewer.fleet_recorder import FLIGHT_NUMBER, FleetRecorder
from groundstation.viewer.fleet_text import aircraft_text, failed_text, flights_text
from groundstation.viewer.held_stream import HeldStream
from groundstation.viewer.recording import save_stream, send_layout
from groundstation.viewer.views import document

Logged = tuple[ChartedAircraft, dict[str, rrb.View]]  # an aircraft and the views of the quantities it has
FLEET = "fleet"
FLIGHTS_TEXT = "flights"  # entity of the table of flights
TABLE_SHARE = 2.0  # of the height, in densities, where there are several: with less the table shows its head alone


def write_fleet_recording(path: Path, fleet: FleetResults, systems: Systems, layout: bytes = b"") -> None:
    """Write the recording of a fleet, blueprint embedded.

    Parameters
    ----------
    path : Path
        The .rrd file; its folder holds the flight folders that its links name. Moved into place when complete.
    fleet : FleetResults
    systems : Systems
    layout : bytes
        A saved layout in place of the default one; empty: none.

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    save_stream(path, FLEET, lambda stream: send_fleet(stream, fleet, systems, layout))


def send_fleet(stream: rr.RecordingStream, fleet: FleetResults, systems: Systems, layout: bytes = b"") -> rrb.Blueprint:
    """Log a fleet to a stream that has its sink, its layout or a saved one first.

    Waits until all is out; returns the layout.
    """
    held = HeldStream(stream)
    recorder = FleetRecorder(held.stream, fleet, systems)
    stream.send_recording_name("Fleet")
    logged = (held.attempt("aircraft", one.name, partial(_logged, recorder, fleet, one)) for one in aircraft_of(fleet))
    found = [one for one in logged if one is not None]
    tabs = [
        *(held.attempt("tab", name, partial(tab, recorder, fleet, found)) for name, tab in TABS.items()),
        *(held.attempt("tab", tab.name, partial(tab.log, recorder, fleet)) for tab in systems.fleet_tabs),
        *(held.attempt("tab", name, partial(tab, recorder, fleet, found)) for name, tab in TABS_BEHIND.items()),
    ]
    shown = [tab for tab in tabs if tab is not None]
    # on utc, the flights of a year are columns of dots
    own = send_layout(stream, shown, timeline=FLIGHT_NUMBER, saved=layout)
    held.release()
    return own


def _logged(recorder: FleetRecorder, fleet: FleetResults, one: ChartedAircraft) -> Logged | None:
    """Log an aircraft; None for one that no flight judged or measured."""
    views = log_aircraft(recorder, fleet, one)
    return (one, views) if views or is_judged(fleet, one) else None


def _fleet(recorder: FleetRecorder, fleet: FleetResults, found: list[Logged]) -> rrb.Container | None:
    """Log what all aircraft have in common; None where there is neither a figure nor a table."""
    aircraft = [one for one, _ in found]
    text = aircraft_text(fleet, {one.name: one.entity for one in aircraft}, recorder.systems)
    judged = [one for one in aircraft if is_judged(fleet, one)]
    errors = by_aircraft([one for one, views in found if HEADING in views], HEADING)
    plots = [*errors, *([verdicts(judged)] if judged else [])]
    answer = heading_error_density(recorder, fleet, aircraft)
    if text:
        recorder.document("by_aircraft", text)
        answer = [document("By aircraft", "by_aircraft"), *answer]
    shares = [TABLE_SHARE if text and place == 0 and len(answer) > 2 else 1.0 for place in range(len(answer))]
    columns = [rrb.Vertical(contents=answer, row_shares=shares)] if answer else []
    if plots:
        columns.append(rrb.Vertical(contents=plots, row_shares=[3.0, 1.0][: len(plots)]))
    if not columns:
        return None
    return rrb.Horizontal(contents=columns, name="Fleet")


def _aircraft(_recorder: FleetRecorder, fleet: FleetResults, found: list[Logged]) -> rrb.Container | None:
    own = [
        rrb.Vertical(contents=[*views.values(), *([verdicts([one])] if is_judged(fleet, one) else [])], name=one.label)
        for one, views in found[:MOST_AIRCRAFT]
    ]
    return rrb.Tabs(contents=own, name="Aircraft") if own else None


def _flights(recorder: FleetRecorder, fleet: FleetResults, _found: list[Logged]) -> rrb.Container:
    recorder.document(FLIGHTS_TEXT, flights_text(recorder, fleet))
    return rrb.Vertical(contents=[document("Flights and their recordings", FLIGHTS_TEXT)], name="Flights")


def _failed(recorder: FleetRecorder, fleet: FleetResults, _found: list[Logged]) -> rrb.Container | None:
    if not fleet.not_in_fleet:
        return None
    recorder.document("failed", failed_text(fleet))
    return rrb.Vertical(contents=[document("Logs without a flight", "failed")], name="Failed")


Log = Callable[[FleetRecorder, FleetResults, list[Logged]], rrb.Container | None]
TABS: dict[str, Log] = {"fleet": _fleet, "aircraft": _aircraft}
TABS_BEHIND: dict[str, Log] = {"flights": _flights, "failed": _failed}  # the tabs of the systems
