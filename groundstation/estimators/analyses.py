"""The analyses of a flight and of a session, in the order they are shown. A new one is a folder and a line here."""

from collections.abc import Mapping
from types import MappingProxyType

from groundstation.estimators.analysis import Analysis
from groundstation.estimators.approaches.analysis import LANDING
from groundstation.estimators.cooperative.analysis import COOPERATIVE
from groundstation.estimators.heading.analysis import HEADING
from groundstation.estimators.inertial.analysis import FORECAST, INERTIAL
from groundstation.estimators.latency.analysis import LATENCY
from groundstation.estimators.magnetic.analysis import MAGNETIC, MAGNETIC_GROUND
from groundstation.results.answer import Answer

FLIGHT_ANALYSES: tuple[Analysis, ...] = (HEADING, INERTIAL, FORECAST, LATENCY, MAGNETIC, MAGNETIC_GROUND, LANDING)
SESSION_ANALYSES: tuple[Analysis, ...] = (COOPERATIVE,)

# What the answers of a saved flight or session become, by the name of their analysis.
ANSWER_TYPES: Mapping[str, type[Answer]] = MappingProxyType(
    {analysis.answer.analysis: analysis.answer for analysis in (*FLIGHT_ANALYSES, *SESSION_ANALYSES)}
)
