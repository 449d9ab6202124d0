"""The latency system as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.estimators.latency.analysis import LATENCY
from groundstation.systems.system import System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.latency import latency
    from groundstation.results.latency import Latencies

    return (Chapter((Latencies,), latency),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.chapters.plots import latency

    return latency.PLOTS


def _tabs() -> tuple[Tab, ...]:
    return (Tab(("latency",), None),)


SYSTEM = System(
    name="latency",
    analyses=(LATENCY,),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
