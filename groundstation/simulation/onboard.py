"""Heading estimate of the aircraft's own computer, made and logged during taxi."""

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.simulation.readings import TopicReadings, quantised
from groundstation.simulation.scenario import OnboardSettings
from groundstation.simulation.trajectory import Trajectory

READY_PRECISION_DEG = 0.05  # the paper's limits
READY_QUALITY_DEG = 0.3
STANDING_MPS = 0.1


def onboard_readings(
    trajectory: Trajectory, ins: TopicReadings, gnss: TopicReadings, settings: OnboardSettings
) -> TopicReadings:
    """Run the paper's recursion over computer cycles.

    The last GNSS output is used again until the next one arrives. m_i = m_(i-1) - (m_(i-1) - d_i) / i, e_i = 1.96
    sqrt(s2_i / (i - 1)), quality = standard deviation of m about its own running mean; a cycle counts above the speed
    gate and below the gate on the raw heading rate. It ends when the operator enters the correction, standing lined up;
    an estimate that is not ready is not entered.

    Source: Markelov, Kostishin, Shukalov, Information and Control Systems 2015 No 6, pp. 34-38.
    """
    cycle_ns = np.arange(0, int(trajectory.time_ns[-1]) + 1, round(NS_PER_S / settings.cycle_rate_hz), dtype=np.int64)
    entry_ns = _entry_ns(trajectory)
    difference, used = _cycles(cycle_ns, ins, gnss, settings)
    used &= cycle_ns < entry_ns
    count = np.cumsum(used, dtype=np.int64)
    mean = _running_mean(np.where(used, difference, 0.0), count)
    spread = _running_mean(np.where(used, difference**2, 0.0), count) - mean**2
    precision = NORMAL_95 * np.sqrt(np.maximum(spread, 0.0) / np.maximum(count - 1, 1))
    of_mean = _running_mean(np.where(used, mean, 0.0), count)
    quality = np.sqrt(np.maximum(_running_mean(np.where(used, mean**2, 0.0), count) - of_mean**2, 0.0))
    over = cycle_ns >= entry_ns
    ready = (precision <= READY_PRECISION_DEG) & (quality <= READY_QUALITY_DEG) & (count >= 2)
    status = np.select([over & ready, over, ready, count > 0], ["entered", "off", "ready", "run"], "wait")
    correction = -np.round(mean / settings.entry_step_deg) * settings.entry_step_deg
    rows = np.arange(0, len(cycle_ns), max(round(settings.cycle_rate_hz / settings.log_rate_hz), 1))
    known = (count > 1)[rows]
    columns = {
        "heading_error_deg": Column(quantised(wrap_180(mean), settings.resolution_deg)[rows], known),
        "precision_deg": Column(quantised(precision, settings.resolution_deg)[rows], known),
        "quality_deg": Column(quantised(quality, settings.resolution_deg)[rows], known),
        "cycles": Column(count[rows].astype(np.float64)),
        "correction_entered_deg": Column(quantised(correction, settings.entry_step_deg)[rows], (over & ready)[rows]),
        "status": Column(status[rows]),
    }
    names = ("heading_error_deg", "precision_deg", "quality_deg")
    resolution = dict.fromkeys(names, settings.resolution_deg)
    resolution |= {"correction_entered_deg": settings.entry_step_deg, "cycles": 1.0}
    return TopicReadings("onboard", cycle_ns[rows], columns, resolution)


def _cycles(
    cycle_ns: Int64Array, ins: TopicReadings, gnss: TopicReadings, settings: OnboardSettings
) -> tuple[FloatArray, BoolArray]:
    """Return heading minus track of each cycle, and whether the cycle counts.

    They come from the last outputs of both devices.
    """
    heading_deg = ins.columns["true_heading_deg"].values
    of_ins = np.searchsorted(ins.time_ns, cycle_ns, side="right") - 1
    of_gnss = np.searchsorted(gnss.time_ns, cycle_ns, side="right") - 1
    has_gnss = of_gnss >= 0
    north = gnss.columns["velocity_north_mps"].values[of_gnss]
    east = gnss.columns["velocity_east_mps"].values[of_gnss]
    step_s = float(np.median(np.diff(ins.time_ns))) / NS_PER_S
    rate = np.append(0.0, wrap_180(np.diff(heading_deg)) / step_s)[of_ins]
    used = has_gnss & (np.hypot(north, east) > settings.speed_gate_mps)
    used &= np.abs(rate) <= settings.heading_rate_gate_dps
    used &= cycle_ns - np.where(has_gnss, gnss.time_ns[of_gnss], 0) <= NS_PER_S
    return wrap_180(heading_deg[of_ins] - direction_of(north, east)), used


def _running_mean(values: FloatArray, count: Int64Array) -> FloatArray:
    return np.asarray(np.cumsum(values) / np.maximum(count, 1))


def _entry_ns(trajectory: Trajectory) -> int:
    """Return the time when the operator enters the correction and the mode ends.

    It is at the last standstill before lift-off.
    """
    lift_off = np.flatnonzero(trajectory.airborne)
    if not lift_off.size:
        return int(trajectory.time_ns[-1]) + 1
    before = slice(0, int(lift_off[0]))
    speed = np.hypot(trajectory.velocity_north_mps[before], trajectory.velocity_east_mps[before])
    return int(trajectory.time_ns[np.flatnonzero(speed < STANDING_MPS)[-1]])
