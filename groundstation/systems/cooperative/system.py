"""The cooperative system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.cooperative.analysis import COOPERATIVE
from groundstation.systems.system import InFleet, SessionExport, Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.chapters.plots.comparison import Compared
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.cooperative.answer import CooperativeResult
    from groundstation.systems.cooperative.chapter import cooperative, session_front

    return (Chapter((CooperativeResult,), cooperative, session_front),)


def _fleet_chapters() -> "tuple[FleetChapter, ...]":
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.systems.cooperative.fleet_chapter import build

    return (FleetChapter("sessions", 100, build, "flights"),)


def _in_fleet() -> InFleet:
    from groundstation.systems.cooperative.fleet_share import IN_FLEET

    return IN_FLEET


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.cooperative import plots as cooperative

    return cooperative.PLOTS


def _compared() -> "tuple[Compared, ...]":
    from groundstation.systems.cooperative import comparison_plots

    return (comparison_plots.COMPARED,)


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.cooperative.tab import cooperative

    return (Tab(("cooperative",), cooperative),)


def _study_cooperative() -> "Callable[..., StudyResult]":
    from groundstation.systems.cooperative.study.cooperative import study_cooperative

    return study_cooperative


def _tum() -> "Callable[..., Mapping[str, str]]":
    from groundstation.systems.cooperative.graph_files import tum_files

    return tum_files


def _g2o() -> "Callable[..., Mapping[str, str]]":
    from groundstation.systems.cooperative.graph_files import g2o_file

    return g2o_file


def _study_stations() -> "Callable[..., StudyResult]":
    from groundstation.systems.cooperative.study.stations import study_stations

    return study_stations


SYSTEM = System(
    name="cooperative",
    session_analyses=(COOPERATIVE,),
    studies=(
        Study(
            "cooperative",
            "navigation between aircraft: published figures with ours beside them, divergence, consistency",
            _study_cooperative,
        ),
        Study(
            "stations",
            "ground stations: misplaced ones found, false alarms, and what the answer gains",
            _study_stations,
        ),
    ),
    session_exports=(SessionExport(".tum", _tum), SessionExport(".g2o", _g2o)),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
    fleet_chapters=_fleet_chapters,
    in_fleet=_in_fleet,
    compared=_compared,
)
