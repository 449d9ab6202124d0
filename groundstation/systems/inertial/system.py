"""The inertial system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.inertial.alignment_analysis import GROUND
from groundstation.systems.inertial.analysis import CAUSES, FORECAST, INERTIAL, UNITS
from groundstation.systems.system import FleetTab, InFleet, Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.chapters.plots.comparison import Compared
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.inertial.alignment_answer import GroundResult
    from groundstation.systems.inertial.alignment_chapter import ground
    from groundstation.systems.inertial.answer import InertialResult
    from groundstation.systems.inertial.cause_answer import CausesResult
    from groundstation.systems.inertial.cause_chapter import causes
    from groundstation.systems.inertial.chapter import SOURCES, inertial
    from groundstation.systems.inertial.forecast_answer import ForecastResult
    from groundstation.systems.inertial.forecast_chapter import forecast
    from groundstation.systems.inertial.units_answer import UnitsResult
    from groundstation.systems.inertial.units_chapter import units

    return (
        Chapter((InertialResult,), inertial, sources=SOURCES),
        Chapter((CausesResult,), causes),
        Chapter((GroundResult,), ground),
        Chapter((UnitsResult,), units),
        Chapter((ForecastResult,), forecast, sources=SOURCES),
    )


def _fleet_chapters() -> "tuple[FleetChapter, ...]":
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.systems.inertial import fleet_chapter as skill
    from groundstation.systems.inertial import fleet_drift_chapter as drift
    from groundstation.systems.inertial import fleet_units_chapter as units

    return (
        FleetChapter("ins", 600, drift.build, figures=drift.figures),
        FleetChapter("units", 620, units.build, figures=units.figures),
        FleetChapter("skill", 650, skill.build, figures=skill.figures),
    )


def _fleet_plots() -> "Mapping[str, Describe]":
    from groundstation.systems.inertial import fleet_plots as skill
    from groundstation.systems.inertial.fleet_drift_plots import rates
    from groundstation.systems.inertial.fleet_units_plots import over_dates

    return {"fleet.rates": rates, "fleet.growth": skill.growth, "fleet.skill": skill.flights, "fleet.units": over_dates}


def _fleet_tabs() -> tuple[FleetTab, ...]:
    from groundstation.systems.inertial.fleet_tab import forecast
    from groundstation.systems.inertial.fleet_units_tab import units

    return (FleetTab("units", units), FleetTab("forecast", forecast))


def _in_fleet() -> InFleet:
    from groundstation.systems.inertial.fleet_share import IN_FLEET

    return IN_FLEET


def _advice() -> "Adviser":
    from groundstation.chapters.chapter import Adviser
    from groundstation.systems.inertial.claim_chapter import advise

    return Adviser(advise=advise)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.inertial import cause_plots as causes
    from groundstation.systems.inertial import forecast_plots as forecast
    from groundstation.systems.inertial import plots as inertial
    from groundstation.systems.inertial import units_plots as units

    return {**causes.PLOTS, **forecast.PLOTS, **inertial.PLOTS, **units.PLOTS}


def _compared() -> "tuple[Compared, ...]":
    from groundstation.systems.inertial import comparison_plots

    return (comparison_plots.COMPARED, comparison_plots.COMPARED_FORECAST)


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.inertial.cause_tab import causes
    from groundstation.systems.inertial.forecast_tab import forecast
    from groundstation.systems.inertial.tab import inertial
    from groundstation.systems.inertial.units_tab import units

    return (
        Tab(("inertial", "ins_ground"), inertial),
        Tab(("ins_causes",), causes),
        Tab(("ins_units",), units),
        Tab(("forecast",), forecast),
    )


def _study_forecast() -> "Callable[..., StudyResult]":
    from groundstation.systems.inertial.study.forecast import study_forecast

    return study_forecast


def _study_causes() -> "Callable[..., StudyResult]":
    from groundstation.systems.inertial.study.causes import study_causes

    return study_causes


def _study_units() -> "Callable[..., StudyResult]":
    from groundstation.systems.inertial.study.units import study_units

    return study_units


def _outcome_units() -> type:
    from groundstation.systems.inertial.study.units_runs import UnitsOutcome

    return UnitsOutcome


def _study_ground() -> "Callable[..., StudyResult]":
    from groundstation.systems.inertial.study.ground import study_ground

    return study_ground


def _outcome_ground() -> type:
    from groundstation.systems.inertial.study.ground_runs import GroundOutcome

    return GroundOutcome


def _study_units_over_time() -> "Callable[..., StudyResult]":
    from groundstation.systems.inertial.study.units_over_time import study_units_over_time

    return study_units_over_time


SYSTEM = System(
    name="inertial",
    analyses=(INERTIAL, CAUSES, FORECAST, UNITS, GROUND),
    studies=(
        Study(
            "forecast",
            "forecast of INS errors: every method under true and false models, and how honest its sigma is",
            _study_forecast,
        ),
        Study(
            "causes",
            "INS errors by cause: coverage of every interval, on eight families and three that break assumptions",
            _study_causes,
        ),
        Study(
            "units",
            "several INS of one flight: false alarms, faults found and named, coverage of the table's intervals",
            _study_units,
            _outcome_units,
        ),
        Study(
            "ground",
            "alignment and shutdown of an INS: coverage of tilt, azimuth, drift while standing and residual speed",
            _study_ground,
            _outcome_ground,
        ),
        Study(
            "units_over_time",
            "histories of INS units: false changes, coverage of slopes, levels and dates",
            _study_units_over_time,
        ),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
    fleet_chapters=_fleet_chapters,
    fleet_plots=_fleet_plots,
    fleet_tabs=_fleet_tabs,
    in_fleet=_in_fleet,
    compared=_compared,
    advice=_advice,
    notebook_names={
        "forecast": "",
        "forecast.hindcast_map": "map-hindcast",
        "inertial.state": "inertial",
        "inertial.tilt_and_drift": "inertial-tilt",
    },
)
