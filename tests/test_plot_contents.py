"""Every plot of simulated flights shows what it showed: a lost series or a changed band is a difference to review."""

import copy
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.systems import systems
from tests.plot_contents import CASES, KEPT, RUN, Contents, differences, of_flight
from tests.saved import load
from tests.told import COMPARED, PLOTS

MOST_BYTES = 150_000
ANEW = "reviewed and wanted? make golden"
# Of what takes long to simulate: landings by ranges, joined logs, a reference; of what the flights lack.
NOT_KEPT = {
    *("landing_ranges.space", "landing_ranges.accuracy", "landing_ranges.trials"),
    *("together.motion", "reference.errors", "reference.track", "reference.claims"),
    *("fleet.deviation", "fleet.installation", "fleet.units", "gnss.pair"),
    *("health.lanes", "health.motors", "health.panels"),  # no case has an autopilot: tests/systems/health/test_pages.py
    *("overview-pressure_altitude_m", "session_errors-two_sigma_r_m", "session_errors-rms_error_m"),
    *("overview-pressure_altitude_m-difference", "session_errors-two_sigma_r_m-difference"),
    "session_errors-rms_error_m-difference",
}


@pytest.fixture(scope="module")
def kept() -> dict[str, Contents]:
    told: dict[str, Contents] = json.loads(KEPT.read_text(encoding="utf-8"))
    return told


@pytest.mark.parametrize("name", CASES)
def test_plots_show_what_they_showed(name: str, kept: dict[str, Contents]) -> None:
    assert differences(CASES[name](), kept[name]) == [], ANEW


@pytest.mark.parametrize("name", RUN)
def test_plots_of_a_run_show_what_they_showed(
    name: str, kept: dict[str, Contents], finished_run: Callable[..., Outcome]
) -> None:
    assert differences(of_flight(load(Path(finished_run(name).folder)).results), kept[name]) == [], ANEW


def test_a_lost_series_a_changed_band_and_a_lost_limit_are_told(kept: dict[str, Contents]) -> None:
    was = kept["comparison"]
    plot = "inertial_states-north_position_m"
    ((panel, lines),) = was[plot].items()
    for changed in (
        lines[:-1],
        [line.replace("low 2000 [-35.04 ", "low 2000 [-35.2 ") for line in lines],
        [line.replace("low 2000", "low 1999") for line in lines],
        [line.replace("Band gnss", "Band ins") for line in lines],
    ):
        now = copy.deepcopy(was)
        now[plot][panel] = changed
        told = differences(now, was)
        assert told and all(plot in one for one in told)
    assert differences({name: panels for name, panels in was.items() if name != plot}, was)
    now = copy.deepcopy(was)
    now[plot][panel] = [line.replace("[-35.04 ", "[-35.0401 ") for line in lines]
    assert differences(now, was) == [], "the last digits are those of a machine"


def test_what_is_kept_is_small_and_of_nearly_every_plot(kept: dict[str, Contents]) -> None:
    assert KEPT.stat().st_size < MOST_BYTES and set(kept) == {*CASES, *RUN}
    known = {*PLOTS, *systems().fleet_plots, *COMPARED}
    told = {
        name
        for plots in kept.values()
        for plot in plots
        for name in known
        if plot == name or plot.startswith(f"{name}.")
    }
    assert known - told == NOT_KEPT
