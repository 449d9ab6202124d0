"""The Rerun recording of a fleet: fleet.rrd, a row a flight, on the timelines ``utc`` and ``flight_number``."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.results.fleet import FleetResults
from groundstation.viewer.fleet_charts import (
    HEADING,
    MOST_AIRCRAFT,
    PATHS,
    aircraft_of,
    log_aircraft,
    over_time,
    skill_by_horizon,
    skill_over_flights,
    verdicts,
)
from groundstation.viewer.fleet_density import heading_error_density
from groundstation.viewer.fleet_recorder import FLIGHT_NUMBER, FleetRecorder
from groundstation.viewer.fleet_text import aircraft_text, failed_text, flights_text, forecast_text
from groundstation.viewer.recording import save_stream, send_layout
from groundstation.viewer.views import document

FLEET = "fleet"
FLIGHTS_TEXT = "flights"  # entity of the table of flights


def write_fleet_recording(path: Path, fleet: FleetResults) -> None:
    """Write the recording of a fleet, blueprint embedded.

    Parameters
    ----------
    path : Path
        The .rrd file; its folder holds the flight folders that its links name. Moved into place when complete.
    fleet : FleetResults

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    save_stream(path, FLEET, lambda stream: send_fleet(stream, fleet))


def send_fleet(stream: rr.RecordingStream, fleet: FleetResults) -> rrb.Blueprint:
    """Log a fleet to a stream that has its sink, send the layout, wait until all is out; returns the layout."""
    recorder = FleetRecorder(stream, fleet)
    stream.send_recording_name("Fleet")
    aircraft = aircraft_of(fleet)
    found = [(one, log_aircraft(recorder, fleet, one)) for one in aircraft]
    recorder.document("by_aircraft", aircraft_text(fleet, {one.name: one.entity for one in aircraft}))
    recorder.document(FLIGHTS_TEXT, flights_text(recorder, fleet))
    plots = [*over_time(found, HEADING), *([verdicts(aircraft)] if aircraft else [])]
    answer = [document("By aircraft", "by_aircraft"), *heading_error_density(recorder, fleet)]
    columns = [rrb.Vertical(contents=answer)]
    if plots:
        columns.append(rrb.Vertical(contents=plots, row_shares=[3.0, 1.0][: len(plots)]))
    tabs: list[rrb.Container] = [rrb.Horizontal(contents=columns, name="Fleet")]
    own = [
        rrb.Vertical(
            contents=[*(view for quantity in PATHS for view in over_time([(one, names)], quantity)), verdicts([one])],
            name=one.label,
        )
        for one, names in found[:MOST_AIRCRAFT]
    ]
    if own:
        tabs.append(rrb.Tabs(contents=own, name="Aircraft"))
    forecast = [*skill_over_flights(recorder, fleet), *skill_by_horizon(recorder, fleet)]
    if skill := forecast_text(fleet):
        recorder.document("forecast/skill", skill)
        views = [*forecast, document("Skill of the forecast", "forecast/skill")]
        tabs.append(rrb.Grid(contents=views, grid_columns=2, name="Forecast"))
    tabs.append(rrb.Vertical(contents=[document("Flights and their recordings", FLIGHTS_TEXT)], name="Flights"))
    if fleet.not_in_fleet:
        recorder.document("failed", failed_text(fleet))
        tabs.append(rrb.Vertical(contents=[document("Logs without a flight", "failed")], name="Failed"))
    return send_layout(stream, tabs, timeline=FLIGHT_NUMBER)  # on utc, the flights of a year are a few columns of dots
