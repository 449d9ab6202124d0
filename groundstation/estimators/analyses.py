"""The analyses of a flight, in the order they are shown. A new one is a folder of its own and a line here."""

from collections.abc import Mapping
from types import MappingProxyType

from groundstation.estimators.analysis import Analysis
from groundstation.estimators.heading.analysis import HEADING
from groundstation.estimators.inertial.analysis import FORECAST, INERTIAL
from groundstation.estimators.latency.analysis import LATENCY
from groundstation.estimators.magnetic.analysis import MAGNETIC, MAGNETIC_GROUND
from groundstation.results.answer import Answer

FLIGHT_ANALYSES: tuple[Analysis, ...] = (HEADING, INERTIAL, FORECAST, LATENCY, MAGNETIC, MAGNETIC_GROUND)

# What the answers of a saved flight become, by the name of their analysis.
ANSWER_TYPES: Mapping[str, type[Answer]] = MappingProxyType(
    {analysis.answer.analysis: analysis.answer for analysis in FLIGHT_ANALYSES}
)
