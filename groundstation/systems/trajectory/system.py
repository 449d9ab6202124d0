"""The best trajectory as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.systems.system import System, Tab
from groundstation.systems.trajectory.analysis import TRAJECTORY

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe


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


SYSTEM = System(name="trajectory", analyses=(TRAJECTORY,), chapters=_chapters, plots=_plots, tabs=_tabs)
