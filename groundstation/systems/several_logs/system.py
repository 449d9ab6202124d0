"""The several_logs system as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.systems.several_logs.analysis import TOGETHER_ANALYSIS
from groundstation.systems.system import System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.joining import JoinStep


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.several_logs.answer import Together
    from groundstation.systems.several_logs.chapter import together

    return (Chapter((Together,), together),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.several_logs import plots as together

    return together.PLOTS


def _tabs() -> tuple[Tab, ...]:
    return (Tab(("together",)),)


def _join() -> "JoinStep":
    from groundstation.systems.several_logs.joined import STEP

    return STEP


SYSTEM = System(
    name="several_logs",
    analyses=(TOGETHER_ANALYSIS,),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
    join=_join,
    notebook_names={"together.motion": "together"},
)
