"""The best trajectory as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.system import Study, System, Tab
from groundstation.systems.trajectory.analysis import TRAJECTORY

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.trajectory.answer import BestTrajectory
    from groundstation.systems.trajectory.chapter import trajectory

    return (Chapter((BestTrajectory,), trajectory),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.trajectory import plots as trajectory

    return trajectory.PLOTS


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.trajectory.tab import trajectory

    return (Tab(("trajectory",), trajectory),)


def _study() -> "Callable[..., StudyResult]":
    from groundstation.systems.trajectory.study.trajectory import study_trajectory

    return study_trajectory


SYSTEM = System(
    name="trajectory",
    analyses=(TRAJECTORY,),
    studies=(Study("trajectory", "best trajectory: errors of filter and smoother against their sigmas", _study),),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
