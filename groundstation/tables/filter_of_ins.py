"""Filter that an INS topic is the output of, and whether it flew the aircraft."""

import re

from groundstation.base.dataclasses import dataclass
from groundstation.base.signals import topics_of_kind
from groundstation.tables.estimator_in_use import SIMULATOR, estimator_in_use
from groundstation.tables.table import Flight

_ESTIMATORS = re.compile(r"\b(EKF[123]|DCM)\b")
TRUTH = "the simulator's truth"
_NOT_TOLD = "DCM or a filter that is not logged"
_SECOND = "AHR2, the autopilot's second estimate"


@dataclass(frozen=True)
class FilterOfTopic:
    """Filter of an INS topic.

    ``name`` is empty and ``flew`` None where the log does not tell; ``source`` is the parameter or field that does.
    """

    name: str = ""
    flew: bool | None = None
    source: str = ""


def filter_of_ins(flight: Flight, topic: str) -> FilterOfTopic:
    """Return the filter of an INS topic, and whether it flew the aircraft."""
    told = " ".join(text for key, text in sorted(flight.metadata.items()) if key.startswith(f"derived.{topic}."))
    names = _ESTIMATORS.findall(told.replace(_NOT_TOLD, ""))
    in_use = estimator_in_use(flight)
    name = names[-1] if names else "" if in_use is None or in_use.others else in_use.name
    if _SECOND in told and not names:
        return FilterOfTopic("AHR2", False, "AHR2 is the autopilot's second estimate")
    if TRUTH in told or name == SIMULATOR:  # no filter: nothing estimated it
        return FilterOfTopic(TRUTH, None, "" if in_use is None else in_use.source)
    if in_use is None or not name:
        return FilterOfTopic(name)
    has_others = len(topics_of_kind("ins", flight.topics())) > 1
    return FilterOfTopic(name, in_use.flew(name) if names or not has_others else None, in_use.source)
