"""Protection levels of a satellite receiver along a final, against alarm limits.

Protection levels bound an error; they are not errors.
"""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.signals import topics_of_kind
from groundstation.systems.landing.answer import Protection
from groundstation.systems.landing.arrays import LandingProtection

if TYPE_CHECKING:
    from groundstation.tables.table import Flight, Table

# Operation, horizontal and vertical alarm limit in metres: ICAO Annex 10, volume I, table 3.7.2.4-1; category I at its
# wide end. Non-precision approach has no vertical one.
OPERATIONS = (
    ("non-precision approach", 556.0, float("inf")),
    ("APV-I", 40.0, 50.0),
    ("category I, 35 m vertical", 40.0, 35.0),
    ("APV-II", 40.0, 20.0),
)


def protection_along(
    flight: "Flight", start_s: float, end_s: float, number: int
) -> tuple[Protection, LandingProtection] | None:
    """Return the protection levels of an approach between two times, and their arrays.

    None where the log has none there.
    """
    for topic in topics_of_kind("gnss_integrity", flight.topics()):
        table, time_s = flight[topic], flight.time_s(topic)
        window = (time_s >= start_s) & (time_s <= end_s)
        levels = {axis: _greater(table, axis)[window] for axis in ("horizontal", "vertical")}
        if not np.isfinite(levels["horizontal"]).any():
            continue
        limits = {axis: table.values(f"{axis}_alarm_limit_m")[window] for axis in ("horizontal", "vertical")}
        arrays = LandingProtection(
            time_s=time_s[window],
            horizontal_protection_m=levels["horizontal"],
            horizontal_alarm_limit_m=limits["horizontal"],
            vertical_protection_m=levels["vertical"],
            vertical_alarm_limit_m=limits["vertical"],
            approach=np.full(int(window.sum()), float(number)),
        )
        return _told(levels, limits), arrays
    return None


def _greater(table: "Table", axis: str) -> FloatArray:
    """The greater of the protection levels by augmentation and by fault detection."""
    sources = [table.values(f"{axis}_protection_{by}_m") for by in ("sbas", "fd")]
    return np.asarray(np.fmax(*sources))


def _told(levels: dict[str, FloatArray], limits: dict[str, FloatArray]) -> Protection:
    greatest = {axis: _extreme(levels[axis], greatest=True) for axis in levels}
    least = {axis: _extreme(limits[axis], greatest=False) for axis in limits}
    judged = np.zeros(len(levels["horizontal"]), dtype=bool)
    within = np.ones(len(judged), dtype=bool)
    for axis, level in levels.items():
        known = np.isfinite(level) & np.isfinite(limits[axis])
        judged |= known
        within &= ~known | (level <= limits[axis])
    horizontal, vertical = greatest["horizontal"], greatest["vertical"]
    operations = tuple(
        name
        for name, horizontal_m, vertical_m in OPERATIONS
        if horizontal is not None
        and horizontal <= horizontal_m
        and (np.isinf(vertical_m) or (vertical is not None and vertical <= vertical_m))
    )
    share = float(within[judged].mean()) if judged.any() else None
    epochs = int(np.isfinite(levels["horizontal"]).sum())
    return Protection(
        epochs=epochs,
        horizontal_max_m=horizontal,
        vertical_max_m=vertical,
        horizontal_alarm_limit_m=least["horizontal"],
        vertical_alarm_limit_m=least["vertical"],
        within_share=share,
        operations=operations,
    )


def _extreme(values: FloatArray, *, greatest: bool) -> float | None:
    known = values[np.isfinite(values)]
    if not known.size:
        return None
    return float(known.max() if greatest else known.min())
