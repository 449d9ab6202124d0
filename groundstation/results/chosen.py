"""Intervals that the user left out of the estimates, or forced into them.

They come from the configuration of a run, and are given to the methods in flight seconds.
"""

import math
from collections.abc import Mapping
from typing import Any, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError

Use = Literal["exclude", "force"]
USES: tuple[Use, ...] = ("exclude", "force")


@dataclass(frozen=True)
class ChosenInterval:
    """Part of a flight chosen by hand; its ends as the user wrote them."""

    use: Use
    start: str
    end: str
    reason: str = ""


@dataclass(frozen=True)
class Interval:
    """Flight seconds that a file excludes from the estimate, or forces into it."""

    start_s: float
    end_s: float
    use: Use = "exclude"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start_s) and math.isfinite(self.end_s)):
            raise SettingsError("interval", f"{self.start_s:g} to {self.end_s:g} s", "finite flight seconds")


def chosen_intervals(configuration: Mapping[str, Any]) -> tuple[ChosenInterval, ...]:
    """The intervals in the configuration that a manifest keeps, those left out first.

    Examples
    --------
    >>> chosen_intervals({"exclude": [{"from": "+03:10", "to": "+03:15", "reason": "towed"}]})
    (ChosenInterval(use='exclude', start='+03:10', end='+03:15', reason='towed'),)
    >>> chosen_intervals({})
    ()
    """
    return tuple(
        ChosenInterval(use, str(one["from"]), str(one["to"]), str(one.get("reason") or ""))
        for use in USES
        for one in configuration.get(use, ())
    )
