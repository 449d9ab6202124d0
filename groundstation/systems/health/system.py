"""The health system as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.systems.health.analysis import HEALTH
from groundstation.systems.system import System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter
    from groundstation.plots.plot import Describe


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.health.answer import AutopilotHealth
    from groundstation.systems.health.chapter import health

    return (Chapter((AutopilotHealth,), health),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.health import plots as health

    return health.PLOTS


def _advice() -> "Adviser":
    from groundstation.chapters.chapter import Adviser
    from groundstation.systems.health import advice_chapter

    return Adviser(advise=advice_chapter.advise, withheld=advice_chapter.withheld)


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.health.tab import health

    return (Tab(("health",), health),)


SYSTEM = System(name="health", analyses=(HEALTH,), chapters=_chapters, plots=_plots, tabs=_tabs, advice=_advice)
