"""States along a flight as an answer that plays the role, for tests of what reads it."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from groundstation.results.answer import Answer
from groundstation.results.arrays.states import BodyStates
from groundstation.results.figures import FigureData
from groundstation.results.roles import StatesAlongTheFlight

SIGMAS = (
    *("position_north_sigma_m", "position_east_sigma_m", "vertical_sigma_m"),
    *(f"velocity_{axis}_sigma_mps" for axis in ("north", "east", "down")),
    *("roll_sigma_deg", "pitch_sigma_deg", "true_heading_sigma_deg"),
)


@dataclass(frozen=True)
class MadeStates(Answer, StatesAlongTheFlight):
    """States that a test gives."""

    analysis: ClassVar[str] = "made"
    states_name: ClassVar[str] = analysis

    states: BodyStates | None = None
    accepted: bool = True
    latency: tuple[float, float] | None = None
    figures: tuple[FigureData, ...] = field(default=())

    @property
    def gnss_topic(self) -> str:
        return "gnss"

    @property
    def is_reference(self) -> bool:
        return self.accepted

    @property
    def by_it(self) -> str:
        return "by the best trajectory"

    @property
    def antenna_arm_m(self) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.0

    def velocity_latency(self, ins_topic: str) -> tuple[float, float] | None:
        return self.latency if ins_topic == "ins" else None

    def body_states(self) -> BodyStates | None:
        return self.states


def states_of(time_s: np.ndarray, sigma: float = 0.1, **columns: np.ndarray) -> BodyStates:
    """States of one segment; what is not given is zero, every sigma is the same."""
    zero = np.zeros(len(time_s))
    names = ("latitude_deg", "longitude_deg", "altitude_msl_m", "roll_deg", "pitch_deg", "true_heading_deg")
    moves = tuple(f"velocity_{axis}_mps" for axis in ("north", "east", "down"))
    made = {name: columns.get(name, zero) for name in (*names, *moves)}
    segment = np.zeros(len(time_s), dtype=np.int64)
    return BodyStates(time_s=time_s, segment=segment, **made, **dict.fromkeys(SIGMAS, zero + sigma))
