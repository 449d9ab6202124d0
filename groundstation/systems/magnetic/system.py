"""The magnetic system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.estimators.magnetic.analysis import MAGNETIC, MAGNETIC_GROUND
from groundstation.systems.system import Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.magnetic import magnetic
    from groundstation.results.magnetic import MagneticResult
    from groundstation.results.magnetic_ground import GroundDeviation

    return (
        Chapter(
            (
                MagneticResult,
                GroundDeviation,
            ),
            magnetic,
        ),
    )


def _plots() -> "Mapping[str, Describe]":
    from groundstation.chapters.plots import magnetic

    return magnetic.PLOTS


def _tabs() -> tuple[Tab, ...]:
    from groundstation.viewer.tabs.magnetic import magnetic

    return (
        Tab(
            (
                "magnetic",
                "magnetic_ground",
            ),
            magnetic,
        ),
    )


def _study_magnetic() -> "Callable[..., StudyResult]":
    from groundstation.studies.magnetic import study_magnetic

    return study_magnetic


SYSTEM = System(
    name="magnetic",
    analyses=(
        MAGNETIC,
        MAGNETIC_GROUND,
    ),
    studies=(
        Study(
            "magnetic",
            "magnetic deviation: error of every method, the published claim and its limit, how honest sigmas are",
            _study_magnetic,
        ),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
