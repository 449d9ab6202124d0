"""Remarks that a reader of the magnetic chapter needs beside the figures."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.results.arrays.typed import found_in
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.arrays import MagneticTable
from groundstation.systems.magnetic.entered import corrections_entered
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.sources import UNAIDED
from groundstation.tables.table import Flight

WORTH_TELLING_DEG, LATENCY_TOLD_S = 0.1, 0.001


def remarks_on(
    flight: Flight, result: MagneticResult, latency_s: float, kinds: Mapping[str, str], settings: MagneticSettings
) -> tuple[str, ...]:
    """One line each."""
    told = ["A also contains the mounting of the magnetometer, the INS heading error and the error of declination"]
    if result.alignment.aligned_at_s is None:
        told.append(
            f"the INS heading is {result.alignment.origin}; a sigma of {settings.alignment_sigma_deg:g} deg is assumed"
        )
    by_states = result.alignment.source("states")
    if by_states is not None and by_states.is_used:
        told.append(f"{result.alignment.origin}: no magnetometer is in them")
    elif settings.trusts_aided_heading:
        told.append("the settings state that no magnetometer corrects the INS heading; the log does not show it")
    elif kinds.get(result.ins_topic) != UNAIDED:
        told.append("the log does not show whether a magnetometer corrects the INS heading; none is assumed")
    low = [turn for turn in result.turns if turn.state == "used" and _below(turn.altitude_m, settings.altitude_min_m)]
    if low:
        told.append(
            f"flown at {low[0].altitude_m:.0f} m, below {settings.altitude_min_m:g} m: iron on the ground may matter"
        )
    if abs(latency_s) >= LATENCY_TOLD_S:
        told.append(f"the magnetometer was shifted back by its latency of {latency_s:+.3f} s")
    told += _between_branches(result)
    if result.coverage.interpolated_bins:
        told.append(f"{result.coverage.interpolated_bins} of 360 bins lack readings of a branch and are interpolated")
    told += _entered(flight, result)
    return tuple(told)


def _below(altitude_m: float | None, limit_m: float) -> bool:
    return altitude_m is not None and altitude_m < limit_m


def _between_branches(result: MagneticResult) -> list[str]:
    """A constant difference of the branches: what a latency of the magnetometer would make."""
    table = found_in(result.figures, MagneticTable)
    if table is None:
        return []
    half = 0.5 * wrap_180(table.right_turn_deg - table.left_turn_deg)
    half = half[np.isfinite(half)]
    used = [turn for turn in result.turns if turn.state == "used" and turn.end_s > turn.start_s]
    rate = float(np.mean([abs(turn.turned_deg) / (turn.end_s - turn.start_s) for turn in used]))
    if not half.size or abs(np.mean(half)) < WORTH_TELLING_DEG or rate <= 0.0:
        return []
    return [
        f"right and left turns differ by twice {np.mean(half):+.2f} deg in the mean, which a magnetometer "
        f"{-np.mean(half) / rate:+.3f} s late would cause (or iron along the vertical); the average is free of it"
    ]


def _entered(flight: Flight, result: MagneticResult) -> list[str]:
    """A correction entered on board after the alignment moves the INS heading, perhaps."""
    aligned_at_s = result.alignment.aligned_at_s
    if aligned_at_s is None:
        return []
    late = [one for one in corrections_entered(flight) if one.time_s > aligned_at_s and one.change_deg != 0.0]
    return [
        f"a correction of {one.correction_deg:+.2f} deg was entered at {one.time_s:.0f} s, after the "
        "alignment: if the INS heading includes it, A and the table are off by that much"
        for one in late[-1:]
    ]
