"""The criteria of a stabilised approach, from a gate height down to where the flare begins."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.estimators.approaches.geometry import Against
from groundstation.estimators.approaches.path import FlightPath
from groundstation.estimators.approaches.settings import LandingSettings
from groundstation.results.heading import Gate
from groundstation.results.landing import StabilisedAt

LAST_SPEED_S = 10.0  # the speed of reference is that of so many seconds above the floor
FEWEST = 3


def stabilised(path: FlightPath, near: Against, settings: LandingSettings) -> tuple[StabilisedAt, ...]:
    """Judge the final from both gate heights, the higher first."""
    return tuple(_from(path, near, height_m, settings) for height_m in (settings.gate_high_m, settings.gate_low_m))


def _from(path: FlightPath, near: Against, gate_m: float, settings: LandingSettings) -> StabilisedAt:
    """Worst values from the last time the aircraft was above the gate down to the floor, or to the lowest point."""
    height = np.where(near.is_final, near.height_m, np.nan)
    known = np.isfinite(height)
    above = np.flatnonzero(known & (height >= gate_m))
    reason = _not_passed(height, gate_m)
    if reason:
        return StabilisedAt(gate_m, "not measured", None, (), reason)
    start = int(above[-1])
    below = np.flatnonzero(known & (height < settings.gate_floor_m) & (np.arange(len(height)) > start))
    stop = int(below[0]) if below.size else int(np.flatnonzero(near.is_final)[-1]) + 1
    rows = slice(near.rows.start + start, near.rows.start + stop)
    time_s = path.time_s[rows]
    speed, speed_name = path.airspeed_mps[rows], "airspeed"
    if not np.isfinite(speed).any():
        speed, speed_name = path.ground_speed_mps[rows], "ground speed"
    last = speed[(time_s >= time_s[-1] - LAST_SPEED_S) & np.isfinite(speed)] if len(time_s) else speed
    faster = speed - float(np.median(last)) if last.size else np.full(len(speed), np.nan)
    limit = settings.deviation_max_dots
    gates = (
        _gate("lateral", "course deviation", np.abs(path.lateral_dots[rows]), limit, "dots"),
        _gate("vertical", "glide path deviation", np.abs(path.vertical_dots[rows]), limit, "dots"),
        _gate("sink_rate", "sink rate", path.sink_rate_mps[rows], settings.sink_rate_max_mps, "m/s"),
        _gate("bank", "bank", np.abs(path.bank_deg[rows]), settings.bank_max_deg, "deg"),
        _gate("speed", f"{speed_name} above that at the end", faster, settings.speed_above_max_mps, "m/s"),
    )
    states = {gate.state for gate in gates}
    verdict = "not stabilised" if "failed" in states else "stabilised" if "passed" in states else "not measured"
    return StabilisedAt(gate_m, verdict, float(time_s[0]) if len(time_s) else None, gates)  # type: ignore[arg-type]


def _not_passed(height_m: FloatArray, gate_m: float) -> str:
    """Why a gate height was not passed on a final; empty where it was."""
    if not np.isfinite(height_m).any():
        return "no height above the threshold"
    if np.nanmax(height_m) < gate_m:
        return f"the straight final begins at {np.nanmax(height_m):.0f} m"
    return f"the lowest point is at {np.nanmin(height_m):.0f} m" if np.nanmin(height_m) >= gate_m else ""


def _gate(name: str, title: str, values: FloatArray, limit: float, unit: str) -> Gate:
    if np.isfinite(values).sum() < FEWEST:
        return Gate(name, title, None, limit, unit, "not_measured", reason="not in the log")
    value = float(np.nanmax(values))
    return Gate(name, title, value, limit, unit, "passed" if value <= limit else "failed")
