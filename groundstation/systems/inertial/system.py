"""The inertial system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.inertial.analysis import FORECAST, INERTIAL
from groundstation.systems.system import Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.inertial.answer import InertialResult
    from groundstation.systems.inertial.chapter import inertial
    from groundstation.systems.inertial.forecast_answer import ForecastResult
    from groundstation.systems.inertial.forecast_chapter import forecast

    return (
        Chapter((InertialResult,), inertial),
        Chapter((ForecastResult,), forecast),
    )


def _advice() -> "Adviser":
    from groundstation.chapters.chapter import Adviser
    from groundstation.systems.inertial import advice_chapter

    return Adviser(advise=advice_chapter.advise)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.inertial import forecast_plots as forecast
    from groundstation.systems.inertial import plots as inertial

    return {**forecast.PLOTS, **inertial.PLOTS}


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.inertial.forecast_tab import forecast
    from groundstation.systems.inertial.tab import inertial

    return (
        Tab(("inertial",), inertial),
        Tab(("forecast",), forecast),
    )


def _study_forecast() -> "Callable[..., StudyResult]":
    from groundstation.systems.inertial.study.forecast import study_forecast

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
    advice=_advice,
)
