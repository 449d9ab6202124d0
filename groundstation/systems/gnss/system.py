"""The GNSS reception as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.systems.gnss.analysis import GNSS
from groundstation.systems.system import System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter
    from groundstation.plots.plot import Describe


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.gnss.answer import GnssReception
    from groundstation.systems.gnss.chapter import gnss

    return (Chapter((GnssReception,), gnss),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.gnss import plots as gnss

    return gnss.PLOTS


def _advice() -> "Adviser":
    from groundstation.chapters.chapter import Adviser
    from groundstation.systems.gnss.advice_chapter import advise

    return Adviser(advise=advise)


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.gnss.tab import gnss

    return (Tab(("gnss",), gnss),)


SYSTEM = System(name="gnss", analyses=(GNSS,), chapters=_chapters, plots=_plots, tabs=_tabs, advice=_advice)
