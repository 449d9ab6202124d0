"""The reference system as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.estimators.reference.analysis import REFERENCE
from groundstation.systems.system import System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.reference import reference
    from groundstation.results.reference import ReferenceResult

    return (Chapter((ReferenceResult,), reference),)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.chapters.plots import reference

    return reference.PLOTS


def _tabs() -> tuple[Tab, ...]:
    from groundstation.viewer.tabs.reference import reference

    return (Tab(("reference",), reference),)


SYSTEM = System(
    name="reference",
    analyses=(REFERENCE,),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
