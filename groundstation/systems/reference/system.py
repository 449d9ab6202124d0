"""The reference system as one object."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from groundstation.systems.reference.analysis import REFERENCE
from groundstation.systems.system import InFleet, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.plots.plot import Describe


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.reference.answer import ReferenceResult
    from groundstation.systems.reference.chapter import reference

    return (Chapter((ReferenceResult,), reference),)


def _fleet_chapters() -> "tuple[FleetChapter, ...]":
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.systems.reference import fleet_chapter as calibration

    build, figures = calibration.build, calibration.figures
    return (FleetChapter("calibration", 700, build, "aircraft", calibration.has_checks, figures),)


def _fleet_plots() -> "Mapping[str, Describe]":
    from groundstation.systems.reference.fleet_plots import checks

    return {"fleet.calibration": checks}


def _in_fleet() -> InFleet:
    from groundstation.systems.reference.fleet_share import IN_FLEET

    return IN_FLEET


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.reference import plots as reference

    return reference.PLOTS


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.reference.tab import reference

    return (Tab(("reference",), reference),)


SYSTEM = System(
    name="reference",
    analyses=(REFERENCE,),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
    fleet_chapters=_fleet_chapters,
    fleet_plots=_fleet_plots,
    in_fleet=_in_fleet,
    notebook_names={"reference.errors": "reference"},
)
