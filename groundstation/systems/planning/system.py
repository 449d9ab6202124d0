"""The planning system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.planning.landing.plan import LANDING_PLAN
from groundstation.systems.planning.session.analysis import SESSION_PLAN
from groundstation.systems.system import Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.planning.landing.answer import RangeLanding
    from groundstation.systems.planning.landing.chapter import landing_ranges
    from groundstation.systems.planning.session.answer import ControlPlan
    from groundstation.systems.planning.session.chapter import control
    from groundstation.systems.planning.session.placement_answer import PlacementPlan
    from groundstation.systems.planning.session.placement_chapter import placement

    return (
        Chapter((ControlPlan,), control),
        Chapter((PlacementPlan,), placement),
        Chapter((RangeLanding,), landing_ranges),
    )


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.planning.landing import plots as landing_ranges
    from groundstation.systems.planning.session import placement_plots as placement
    from groundstation.systems.planning.session import plots as control

    return {**control.PLOTS, **placement.PLOTS, **landing_ranges.PLOTS}


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.planning.landing.tab import landing_ranges
    from groundstation.systems.planning.session.placement_tab import placement
    from groundstation.systems.planning.session.tab import control

    return (
        Tab(("control",), control),
        Tab(("placement",), placement),
        Tab(("landing_ranges",), landing_ranges),
    )


def _study_control() -> "Callable[..., StudyResult]":
    from groundstation.systems.planning.session.study.control import study_control

    return study_control


def _study_landing() -> "Callable[..., StudyResult]":
    from groundstation.systems.planning.landing.study.landing import study_landing

    return study_landing


SYSTEM = System(
    name="planning",
    plans=(SESSION_PLAN, LANDING_PLAN),
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
    notebook_names={
        "landing_ranges.accuracy": "landing-accuracy",
        "landing_ranges.space": "landing-space",
        "landing_ranges.trials": "landing-trials",
    },
)
