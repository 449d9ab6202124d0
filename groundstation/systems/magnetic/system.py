"""The magnetic system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.magnetic.analysis import MAGNETIC, MAGNETIC_FLUX, MAGNETIC_GROUND
from groundstation.systems.magnetic.answer import DEVIATION_CSV, STEER_CARD
from groundstation.systems.system import Export, Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.chapters.parts import Paper
    from groundstation.plots.plot import Describe
    from groundstation.systems.applied import ApplyStep
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.magnetic.answer import MagneticResult
    from groundstation.systems.magnetic.chapter import SOURCES, magnetic
    from groundstation.systems.magnetic.flux_answer import FluxDeviation
    from groundstation.systems.magnetic.ground_answer import GroundDeviation

    return (
        Chapter(
            (MagneticResult, GroundDeviation, FluxDeviation),
            magnetic,
            sources=SOURCES,
        ),
    )


def _fleet_chapters() -> "tuple[FleetChapter, ...]":
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.systems.magnetic.fleet_chapter import build

    return (FleetChapter("deviation", 800, build),)


def _fleet_plots() -> "Mapping[str, Describe]":
    from groundstation.systems.magnetic.fleet_plots import curves

    return {"fleet.deviation": curves}


def _advice() -> "Adviser":
    from groundstation.chapters.chapter import Adviser
    from groundstation.systems.magnetic import flux_advice_chapter
    from groundstation.systems.magnetic.chapter import REMEDIES

    return Adviser((*REMEDIES, *flux_advice_chapter.REMEDIES), flux_advice_chapter.advise)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.magnetic import flux_plots
    from groundstation.systems.magnetic import plots as magnetic

    return {**magnetic.PLOTS, **flux_plots.PLOTS}


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.magnetic.tab import magnetic

    return (
        Tab(
            ("magnetic", "magnetic_ground", "magnetic_flux"),
            magnetic,
        ),
    )


def _deviation_csv() -> Callable[..., str | None]:
    from groundstation.systems.magnetic.deviation_answer import deviation_csv

    return deviation_csv


def _steer_card() -> "Callable[..., Paper | None]":
    from groundstation.systems.magnetic.steer_card_page import steer_card_page

    return steer_card_page


def _study_magnetic() -> "Callable[..., StudyResult]":
    from groundstation.systems.magnetic.study.magnetic import study_magnetic

    return study_magnetic


def _study_flux() -> "Callable[..., StudyResult]":
    from groundstation.systems.magnetic.study.flux import study_flux

    return study_flux


def _apply() -> "ApplyStep":
    from groundstation.systems.magnetic.apply_deviation import STEP

    return STEP


SYSTEM = System(
    name="magnetic",
    analyses=(MAGNETIC, MAGNETIC_GROUND, MAGNETIC_FLUX),
    studies=(
        Study(
            "magnetic",
            "magnetic deviation: error of every method, the published claim and its limit, how honest sigmas are",
            _study_magnetic,
        ),
        Study("flux", "flux valve in flight: how honest the sigmas of A to E are, cell by cell", _study_flux),
    ),
    exports=(
        Export(DEVIATION_CSV, MAGNETIC.name, _deviation_csv),
        Export(STEER_CARD, MAGNETIC.name, _steer_card, is_page=True),
        Export(DEVIATION_CSV, MAGNETIC_FLUX.name, _deviation_csv),
        Export(STEER_CARD, MAGNETIC_FLUX.name, _steer_card, is_page=True),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
    fleet_chapters=_fleet_chapters,
    fleet_plots=_fleet_plots,
    advice=_advice,
    apply=_apply,
    notebook_names={"magnetic.ground_runs": "magnetic-ground"},
)
