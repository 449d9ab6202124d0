"""A made answer with states along a flight, for systems that use such states by their role."""

from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.results.answer import Answer
from groundstation.results.arrays.states import BodyStates
from groundstation.results.figures import FigureData
from groundstation.results.roles import StatesAlongTheFlight

BY = "by a better unit"


@dataclass(frozen=True)
class MadeStates(Answer, StatesAlongTheFlight):
    """States, and whether their checks hold."""

    analysis: ClassVar[str] = "states"
    states_name: ClassVar[str] = "states"
    states: BodyStates
    is_good: bool = True
    figures: tuple[FigureData, ...] = ()

    @property
    def gnss_topic(self) -> str:
        return "gnss"

    @property
    def gnss_latency(self) -> tuple[float, float] | None:
        return None

    @property
    def antenna_arm_m(self) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.0

    @property
    def is_reference(self) -> bool:
        return self.is_good

    @property
    def by_it(self) -> str:
        return BY

    @property
    def states_title(self) -> str:
        return "states of a better unit"

    def body_states(self) -> BodyStates:
        return self.states


def made_states(time_s: FloatArray, **columns: FloatArray | float) -> BodyStates:
    """States of one segment; numbers hold all along, what is not given is 0."""
    level = np.zeros(len(time_s))
    names = [item.name for item in fields(BodyStates) if item.name not in ("time_s", "segment")]
    values = {name: np.asarray(columns.get(name, 0.0) + level) for name in names}
    return BodyStates(time_s=time_s, segment=level.astype(np.int64), **values)
