"""Intervals of flight time that a user forces or excludes."""

import math
from dataclasses import dataclass
from typing import Literal

from groundstation.base.errors import SettingsError


@dataclass(frozen=True)
class Interval:
    """Flight seconds that a file excludes from the estimate, or forces into it."""

    start_s: float
    end_s: float
    use: Literal["exclude", "force"] = "exclude"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start_s) and math.isfinite(self.end_s)):
            raise SettingsError("interval", f"{self.start_s:g} to {self.end_s:g} s", "finite flight seconds")
