"""Settings of autopilot health: what differs from thresholds.toml."""

from collections.abc import Mapping
from dataclasses import field

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number
from groundstation.systems.health.limits import Limit, thresholds


@dataclass(frozen=True)
class HealthSettings:
    """Thresholds that the user sets, by quantity, and how much is told.

    Parameters
    ----------
    thresholds : mapping of str to Limit
        ``[health.thresholds.hdop]`` with ``amber = 2`` changes that limit alone.
    most_messages : int
        So many logged lines and changes of mode are kept, warnings and failures first; the others are counted.
    """

    thresholds: Mapping[str, Limit] = field(default_factory=dict)
    most_messages: int = number(200, 0, 100_000)

    def __post_init__(self) -> None:
        check_ranges(self)
        thresholds(self.thresholds)
