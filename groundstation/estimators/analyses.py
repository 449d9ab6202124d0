"""Analyses of a flight and of a session, and plans, in the order they are shown.

A new one is a line here.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from groundstation.estimators.analysis import Analysis
from groundstation.estimators.approaches.analysis import LANDING
from groundstation.estimators.control.analysis import SESSION_PLAN
from groundstation.estimators.cooperative.analysis import COOPERATIVE
from groundstation.estimators.heading.analysis import HEADING
from groundstation.estimators.inertial.analysis import FORECAST, INERTIAL
from groundstation.estimators.installation.analysis import INSTALLATION
from groundstation.estimators.landing_beacons.analysis import LANDING_BEACONS
from groundstation.estimators.landing_ranges.plan import LANDING_PLAN
from groundstation.estimators.latency.analysis import LATENCY
from groundstation.estimators.magnetic.analysis import MAGNETIC, MAGNETIC_GROUND
from groundstation.estimators.plan import Plan
from groundstation.estimators.reference.analysis import REFERENCE
from groundstation.estimators.together.analysis import TOGETHER_ANALYSIS
from groundstation.results.answer import Answer

FLIGHT_ANALYSES: tuple[Analysis, ...] = (
    *(HEADING, INSTALLATION, INERTIAL, FORECAST, LATENCY, MAGNETIC, MAGNETIC_GROUND),
    *(LANDING, LANDING_BEACONS),
    TOGETHER_ANALYSIS,
    REFERENCE,
)
SESSION_ANALYSES: tuple[Analysis, ...] = (COOPERATIVE,)
PLANS: tuple[Plan[Any], ...] = (SESSION_PLAN, LANDING_PLAN)

# What the answers of a saved flight, session or plan become, by the name of their analysis.
ANSWER_TYPES: Mapping[str, type[Answer]] = MappingProxyType(
    {
        kind.analysis: kind
        for kind in (
            *(analysis.answer for analysis in (*FLIGHT_ANALYSES, *SESSION_ANALYSES)),
            *(kind for plan in PLANS for kind in plan.answers),
        )
    }
)
