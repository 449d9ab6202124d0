"""Thresholds of the checks: thresholds.toml, and what a user's settings change in it."""

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import cache
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import check_ranges, number, trusted

_FILES = ShippedToml("groundstation.systems", "health", "thresholds of autopilot health")
Rule = Literal["share", "median", "mean", "rise"]


@dataclass(frozen=True)
class Threshold:
    """Limits of one quantity, and what they make of a flight.

    Parameters
    ----------
    check : str
        Key of the check that judges it.
    title : str
        What it is, for people: "test ratio".
    unit : str
    amber, red : float, optional
        A value above is amber, red.
    amber_below, red_below : float, optional
        A value below is amber, red.
    amber_mean : float, optional
        A mean over the time in the air above it warns as well.
    rule : {'share', 'median', 'mean', 'rise'}
        ``share``: the share of time that is amber or red decides. ``median`` and ``mean`` over the flight are compared
        with the limits: amber warns, red fails. ``rise``: a counter; how far it rose is compared with them.
    hold_s : float
        Amber and red count where they last so long.
    warn_amber, fail_amber, warn_red, fail_red : float, optional
        Shares of time above which the check warns or fails; amber includes red. None: it never does.
    worst : {'high', 'low'}
        Which value is told of a quantity that has no limit.
    is_drawn : bool
        Whether it has a curve; a flag or counter shows in the lanes alone.
    source : str
        Where the limits come from, with its date.
    """

    check: str
    title: str
    unit: str = ""
    amber: float | None = None
    red: float | None = None
    amber_below: float | None = None
    red_below: float | None = None
    amber_mean: float | None = None
    rule: Rule = "share"
    hold_s: float = number(0.0, 0.0, 3600.0)
    warn_amber: float | None = number(0.05, 0.0, 1.0)
    fail_amber: float | None = number(None, 0.0, 1.0)
    warn_red: float | None = number(0.0, 0.0, 1.0)
    fail_red: float | None = number(0.05, 0.0, 1.0)
    worst: Literal["high", "low"] = "high"
    is_drawn: bool = True
    source: str = ""

    def __post_init__(self) -> None:
        check_ranges(self)
        for low, high in (("amber", "red"), ("red_below", "amber_below")):
            first, second = getattr(self, low), getattr(self, high)
            if first is not None and second is not None and first > second:
                raise SettingsError(high, f"{second:g}", f"{first:g} or more, which is {low}")

    @property
    def is_judged(self) -> bool:
        """Tell whether it has a limit at all."""
        every = (self.amber, self.red, self.amber_below, self.red_below, self.amber_mean)
        return any(one is not None for one in every)

    @property
    def is_below(self) -> bool:
        """Tell whether its low values are the bad ones."""
        return self.worst == "low" if not self.is_judged else self.amber is None and self.red is None


@dataclass(frozen=True)
class Limit:
    """Limits that a user states of one quantity; the others stay as shipped."""

    amber: float | None = None
    red: float | None = None
    amber_below: float | None = None
    red_below: float | None = None
    amber_mean: float | None = None
    hold_s: float | None = number(None, 0.0, 3600.0)
    warn_amber: float | None = number(None, 0.0, 1.0)
    fail_amber: float | None = number(None, 0.0, 1.0)
    warn_red: float | None = number(None, 0.0, 1.0)
    fail_red: float | None = number(None, 0.0, 1.0)

    def over(self, shipped: Threshold) -> Threshold:
        """Lay what is stated over the shipped threshold."""
        stated = {one.name: getattr(self, one.name) for one in fields(self)}
        changed = {name: value for name, value in stated.items() if value is not None}
        return replace(shipped, **changed, source="set by the user") if changed else shipped


@cache
def shipped() -> Mapping[str, Threshold]:
    """Return the shipped thresholds, by quantity."""
    return {name: trusted(Threshold, table) for name, table in _FILES.read("thresholds").table.items()}


def thresholds(stated: Mapping[str, Limit]) -> dict[str, Threshold]:
    """Return the thresholds in force.

    Raises
    ------
    SettingsError
        For a quantity that no check judges.
    """
    known = shipped()
    for name in stated:
        if name not in known:
            raise SettingsError(f"thresholds.{name}", "a quantity that no check judges", f"one of {', '.join(known)}")
    return {name: stated[name].over(one) if name in stated else one for name, one in known.items()}
