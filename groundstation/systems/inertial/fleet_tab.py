"""Tab of the recording of a fleet: skill of the forecast over all flights."""

import rerun.blueprint as rrb

from groundstation.results.fleet import FleetResults
from groundstation.systems.inertial.fleet_chapter import build
from groundstation.systems.inertial.fleet_plots import by_horizon, growth
from groundstation.viewer.fleet_charts import BY_NUMBER
from groundstation.viewer.fleet_recorder import FleetRecorder
from groundstation.viewer.fleet_text import text_of
from groundstation.viewer.plot_views import over_time, panels_of
from groundstation.viewer.views import document


def forecast(recorder: FleetRecorder, fleet: FleetResults) -> rrb.Container | None:
    """Log the skill of every flight, a series a horizon, and the methods over all flights.

    Returns the layout, None where there is no forecast.
    """
    told = build(fleet)
    if told is None:
        return None
    views = [*_over_flights(recorder, fleet), *panels_of(recorder, growth(fleet))]
    recorder.document("forecast/skill", text_of(told))
    views.append(document("Skill of the forecast", "forecast/skill"))
    return rrb.Grid(contents=views, grid_columns=2, name="Forecast")


def _over_flights(recorder: FleetRecorder, fleet: FleetResults) -> list[rrb.View]:
    told = by_horizon(fleet, BY_NUMBER, recorder.places)
    return [] if told is None else [over_time(recorder, "forecast/rms_by_flight", told, told.y.title)]
