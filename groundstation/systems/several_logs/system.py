"""The several_logs system as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.estimators.together.analysis import TOGETHER_ANALYSIS
from groundstation.systems.system import System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.together import together
    from groundstation.results.together import Together

    return (Chapter((Together,), together),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.chapters.plots import together

    return together.PLOTS


def _tabs() -> tuple[Tab, ...]:
    from groundstation.viewer.tabs.together import together

    return (Tab(("together",), together),)


SYSTEM = System(
    name="several_logs",
    analyses=(TOGETHER_ANALYSIS,),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
