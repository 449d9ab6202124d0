"""The planning system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.estimators.control.analysis import SESSION_PLAN
from groundstation.estimators.landing_ranges.plan import LANDING_PLAN
from groundstation.systems.system import Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.control import control
    from groundstation.chapters.landing_ranges import landing_ranges
    from groundstation.chapters.placement import placement
    from groundstation.results.control import ControlPlan
    from groundstation.results.landing_ranges import RangeLanding
    from groundstation.results.placement import PlacementPlan

    return (
        Chapter((ControlPlan,), control),
        Chapter((PlacementPlan,), placement),
        Chapter((RangeLanding,), landing_ranges),
    )


def _plots() -> "Mapping[str, Describe]":
    from groundstation.chapters.plots import control, landing_ranges, placement

    return {**control.PLOTS, **placement.PLOTS, **landing_ranges.PLOTS}


def _tabs() -> tuple[Tab, ...]:
    from groundstation.viewer.tabs.control import control
    from groundstation.viewer.tabs.landing_ranges import landing_ranges
    from groundstation.viewer.tabs.placement import placement

    return (
        Tab(("control",), control),
        Tab(("placement",), placement),
        Tab(("landing_ranges",), landing_ranges),
    )


def _study_control() -> "Callable[..., StudyResult]":
    from groundstation.studies.control import study_control

    return study_control


def _study_landing() -> "Callable[..., StudyResult]":
    from groundstation.studies.landing import study_landing

    return study_landing


SYSTEM = System(
    name="planning",
    plans=(
        SESSION_PLAN,
        LANDING_PLAN,
    ),
    studies=(
        Study(
            "control",
            "control of a session and placement of ground points: published figures with ours, laws flown",
            _study_control,
        ),
        Study(
            "landing",
            "landing by reference points and by locators: every published figure with ours beside it",
            _study_landing,
        ),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
