"""Answer of the GNSS noise: the speed that GNSS shows at standstill."""

from dataclasses import dataclass, field
from typing import ClassVar

from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData


@dataclass(frozen=True)
class Standing:
    """One standstill, its guards cut off. Times are flight seconds."""

    start_s: float
    end_s: float
    samples: int
    speed_rms_mps: float


@dataclass(frozen=True)
class GnssNoise(Answer):
    """Speed that GNSS shows while the aircraft stands: the noise of its velocity.

    ``start_s``, ``end_s``, ``samples`` and ``speed_rms_mps`` are those of the longest standstill.
    """

    analysis: ClassVar[str] = "gnss_noise"

    gnss_topic: str
    start_s: float
    end_s: float
    samples: int
    speed_rms_mps: float
    standstills: tuple[Standing, ...]
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()
