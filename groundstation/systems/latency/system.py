"""The latency system as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.systems.latency.analysis import LATENCY
from groundstation.systems.system import System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.latency.answer import Latencies
    from groundstation.systems.latency.chapter import latency

    return (Chapter((Latencies,), latency),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.latency import plots as latency

    return latency.PLOTS


def _tabs() -> tuple[Tab, ...]:
    return (Tab(("latency",), part_of="quality"),)


SYSTEM = System(
    name="latency",
    analyses=(LATENCY,),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
