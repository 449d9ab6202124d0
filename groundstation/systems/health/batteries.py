"""Words on batteries: lowest voltage, largest current, their times, before a loss."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.words import tenths_text
from groundstation.systems.health.answer import Check
from groundstation.systems.health.checks import Judged

VOLTAGE, CURRENT, SUPPLY = "battery_v", "battery_a", "supply_v"


def with_batteries(check: Check, judged: Sequence[Judged], lost_s: float | None) -> Check:
    """Return the battery check with what the batteries did in its reason.

    It stands there whether or not the log has limits to judge it by.
    """
    told = "; ".join([*_told(judged, lost_s), *_supply(check)])
    return replace(check, reason="; ".join(filter(None, [check.reason, told]))) if told else check


def _told(judged: Sequence[Judged], lost_s: float | None) -> Iterator[str]:
    sensors = dict.fromkeys(one.measure.sensor for one in judged if one.measure.quantity in (VOLTAGE, CURRENT))
    for sensor in sensors:
        parts = []
        for one in judged:
            measure = one.measure
            if measure.sensor != sensor or measure.quantity not in (VOLTAGE, CURRENT) or not measure.logged_share:
                continue
            how = "down to" if measure.is_below else "up to"
            text = f"{how} {measure.worst:.1f} {measure.unit} at {tenths_text(measure.worst_at_s)}"
            parts.append(text + _before(one, lost_s))
        if parts:
            yield f"{sensor} {', '.join(parts)}"


def _before(one: Judged, lost_s: float | None) -> str:
    """Return the worst value before control was lost, where the worst of all came after it."""
    if lost_s is None or one.measure.worst_at_s < lost_s:
        return ""
    value = one.evidence.value[one.in_air & (one.time_s < lost_s)]
    value = value[np.isfinite(value)]
    if not len(value):
        return ""
    worst = value.min() if one.measure.is_below else value.max()
    return f" ({worst:.1f} {one.measure.unit} before the loss)"


def _supply(check: Check) -> Iterator[str]:
    """Yield the supply of the board, where the reason does not tell it already."""
    for one in check.measures:
        if one.quantity == SUPPLY and one.logged_share and one.title not in check.reason:
            yield one.told
