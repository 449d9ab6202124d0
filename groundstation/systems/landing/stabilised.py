"""Criteria of a stabilised approach, from a check height down to the start of the flare."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.results.gates import Bound, Gate, judged_gate
from groundstation.results.rules import Rejudged
from groundstation.systems.landing.answer import LandingResult, StabilisedAt, StabilisedVerdict
from groundstation.systems.landing.geometry import RelativeToRunway
from groundstation.systems.landing.path import FlightPath
from groundstation.systems.landing.settings import LandingSettings

LAST_SPEED_S = 10.0  # the speed of reference is that of so many seconds above the floor
FEWEST = 3


def stabilised(path: FlightPath, relative: RelativeToRunway, settings: LandingSettings) -> tuple[StabilisedAt, ...]:
    """Judge the final from both check heights, the higher first."""
    return tuple(_from(path, relative, height_m, settings) for height_m in (settings.gate_high_m, settings.gate_low_m))


def _from(
    path: FlightPath, relative: RelativeToRunway, check_height_m: float, settings: LandingSettings
) -> StabilisedAt:
    """Return the worst values from a check height down to the floor, or to the lowest point.

    Samples count from the last time the aircraft was above that height.
    """
    height = np.where(relative.is_final, relative.height_m, np.nan)
    known = np.isfinite(height)
    above = np.flatnonzero(known & (height >= check_height_m))
    reason = _not_passed(height, check_height_m)
    if reason:
        return StabilisedAt(check_height_m, "not measured", None, (), reason)
    start = int(above[-1])
    below = np.flatnonzero(known & (height < settings.gate_floor_m) & (np.arange(len(height)) > start))
    stop = int(below[0]) if below.size else int(np.flatnonzero(relative.is_final)[-1]) + 1
    rows = slice(relative.rows.start + start, relative.rows.start + stop)
    time_s = path.time_s[rows]
    speed, speed_name = path.airspeed_mps[rows], "airspeed"
    if not np.isfinite(speed).any():
        speed, speed_name = path.ground_speed_mps[rows], "ground speed"
    last = speed[(time_s >= time_s[-1] - LAST_SPEED_S) & np.isfinite(speed)]
    faster = speed - float(np.median(last)) if last.size else np.full(len(speed), np.nan)
    bounds = criterion_bounds(settings)
    criteria = (
        _criterion(bounds, "lateral", "course deviation", np.abs(path.lateral_dots[rows]), "dots"),
        _criterion(bounds, "vertical", "glide path deviation", np.abs(path.vertical_dots[rows]), "dots"),
        _criterion(bounds, "sink_rate", "sink rate", path.sink_rate_mps[rows], "m/s"),
        _criterion(bounds, "bank", "bank", np.abs(path.bank_deg[rows]), "deg"),
        _criterion(bounds, "speed", f"{speed_name} above that at the end", faster, "m/s"),
    )
    return StabilisedAt(check_height_m, decide(criteria), float(time_s[0]), criteria)


def criterion_bounds(settings: LandingSettings) -> dict[str, Bound]:
    """Lowest and highest value with which each criterion is met."""
    return {
        "lateral": (None, settings.deviation_max_dots),
        "vertical": (None, settings.deviation_max_dots),
        "sink_rate": (None, settings.sink_rate_max_mps),
        "bank": (None, settings.bank_max_deg),
        "speed": (None, settings.speed_above_max_mps),
    }


def decide(criteria: tuple[Gate, ...]) -> StabilisedVerdict:
    """Return the verdict: not stabilised if a criterion failed, stabilised if any was met."""
    states = {criterion.state for criterion in criteria}
    return "not stabilised" if "failed" in states else "stabilised" if "passed" in states else "not measured"


def rejudge(answer: LandingResult, settings: LandingSettings) -> tuple[Rejudged, ...]:
    """Apply other limits to the criteria of every approach.

    The worst values are those by which they were judged.
    """
    bounds = criterion_bounds(settings)
    found = []
    for place, approach in enumerate(answer.approaches, start=1):
        for row in approach.stabilised:
            after = tuple(one.under(bounds[one.name]) if one.name in bounds else one for one in row.gates)
            subject = f"approach {place} from {row.height_m:.0f} m"
            found.append(Rejudged(subject, row.verdict, decide(after), row.gates, after))
    return tuple(found)


def _not_passed(height_m: FloatArray, check_height_m: float) -> str:
    """Return why a check height was not passed on a final; empty where it was."""
    if not np.isfinite(height_m).any():
        return "no height above the threshold"
    if np.nanmax(height_m) < check_height_m:
        return f"the straight final begins at {np.nanmax(height_m):.0f} m"
    return f"the lowest point is at {np.nanmin(height_m):.0f} m" if np.nanmin(height_m) >= check_height_m else ""


def _criterion(bounds: dict[str, Bound], name: str, title: str, values: FloatArray, unit: str) -> Gate:
    value = float(np.nanmax(values)) if np.isfinite(values).sum() >= FEWEST else None
    return judged_gate(
        bounds[name], name, title, value, unit=unit, reason="" if value is not None else "not in the log"
    )
