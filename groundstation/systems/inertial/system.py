"""The inertial system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.estimators.inertial.analysis import FORECAST, INERTIAL
from groundstation.systems.system import Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.forecast import forecast
    from groundstation.chapters.inertial import inertial
    from groundstation.results.forecast import ForecastResult
    from groundstation.results.inertial import InertialResult

    return (
        Chapter((InertialResult,), inertial),
        Chapter((ForecastResult,), forecast),
    )


def _plots() -> "Mapping[str, Describe]":
    from groundstation.chapters.plots import forecast, inertial

    return {**forecast.PLOTS, **inertial.PLOTS}


def _tabs() -> tuple[Tab, ...]:
    from groundstation.viewer.tabs.forecast import forecast
    from groundstation.viewer.tabs.inertial import inertial

    return (
        Tab(("inertial",), inertial),
        Tab(("forecast",), forecast),
    )


def _study_forecast() -> "Callable[..., StudyResult]":
    from groundstation.studies.forecast import study_forecast

    return study_forecast


SYSTEM = System(
    name="inertial",
    analyses=(
        INERTIAL,
        FORECAST,
    ),
    studies=(
        Study(
            "forecast",
            "forecast of INS errors: every method under true and false models, and how honest its sigma is",
            _study_forecast,
        ),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
