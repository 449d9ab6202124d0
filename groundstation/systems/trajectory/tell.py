"""Rows and arrays of the answer from the estimates of its segments."""

from dataclasses import replace

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import MPS2_PER_G
from groundstation.systems.trajectory.answer import (
    ARM,
    LATENCY,
    TRAVEL,
    VELOCITY_LAG,
    NoiseRow,
    TrajectoryParameter,
    UnitMounting,
)
from groundstation.systems.trajectory.arrays import TrajectoryBiases, TrajectoryOutages
from groundstation.systems.trajectory.axis_turns import angles_of, with_travel_forward
from groundstation.systems.trajectory.estimate import Estimate
from groundstation.systems.trajectory.figures import rows_shown
from groundstation.systems.trajectory.model import DEG, Model
from groundstation.systems.trajectory.mounting import Mounting
from groundstation.systems.trajectory.outages import Outages
from groundstation.systems.trajectory.states import (
    BA,
    BG,
    KEPT_ROWS,
    LAG,
    LAT,
    LEV,
    MA,
    MG,
    MISALIGNED,
    MNT,
    NOT_SQUARE,
    SA,
    SG,
    WHL,
)

DENSITIES = ("gyro noise", "accelerometer noise")
OBSERVABLE = 0.6  # of the sigma at the start: what keeps more of it was not seen
MG_PER = 1e-3 * MPS2_PER_G
NOISES = (
    ("gyro_noise_deg_rth", "gyro noise", "deg/sqrt(h)"),
    ("accel_noise_mps_rth", "accelerometer noise", "m/s/sqrt(h)"),
    ("gyro_walk_dps_rth", "walk of the gyro bias", "deg/s/sqrt(h)"),
    ("accel_walk_mg_rth", "walk of the accelerometer bias", "mg/sqrt(h)"),
    ("gyro_imperfection", "scale and misalignment of the gyro, beside 0.5 % and 0.3 deg", ""),
    ("accel_imperfection", "scale and misalignment of the accelerometer, beside 0.5 % and 0.3 deg", ""),
    ("position_scale", "white error of GNSS position, beside the stated sigma", ""),
    ("slow_scale", "slow error of GNSS position (300 s), beside the stated sigma", ""),
    ("fast_scale", "fast error of GNSS position (10 s), beside the stated sigma", ""),
    ("velocity_scale", "error of GNSS velocity, beside the stated sigma", ""),
    ("velocity_down_scale", "error of its vertical velocity, beside the horizontal one", ""),
    ("baro_m", "error of the barometric height, in a second", "m"),
    ("baro_walk_m_rth", "walk of its offset", "m/sqrt(h)"),
    ("wheel_mps", "error of the speed of the wheels", "m/s"),
    ("jitter_s", "jitter of the stamps of GNSS", "s"),
    ("slip_mps", "sideways motion of what rolls", "m/s"),
    ("slip_walk_deg_rts", "walk of its direction of travel", "deg/sqrt(s)"),
)


def noise_rows(estimate: Estimate) -> tuple[NoiseRow, ...]:
    """Return the numbers of the model: prior, fitted, whether at a bound."""
    prior = Model()
    problem = estimate.problem
    lacking = {"slip": not problem.has_slip, "baro": not problem.has_baro, "wheel": not problem.has_wheels}
    names = [one for one in NOISES if not lacking.get(one[0].split("_")[0], False)]
    return tuple(
        NoiseRow(
            words,
            unit,
            float(getattr(prior, name)),
            float(getattr(estimate.model, name)),
            name in estimate.fit.at_bound,
        )
        for name, words, unit in names
    )


def parameter_rows(estimate: Estimate) -> tuple[TrajectoryParameter, ...]:
    """Return the constants that the log shows, and the biases at its end."""
    value = estimate.result.constants
    sigma, start = np.sqrt(estimate.result.constants_variance), np.sqrt(estimate.problem.variances(estimate.model))
    axes = "xyz"
    rows = []

    def put(at: int, name: str, group: str, unit: str, per: float, offset: float = 0.0) -> None:
        if start[at] > 0.0:
            numbers = (float(value[at]) / per + offset, float(sigma[at]) / per, float(start[at]) / per)
            rows.append(TrajectoryParameter(name, group, unit, *numbers, bool(sigma[at] < OBSERVABLE * start[at])))

    for i, axis in enumerate(axes):
        put(BG + i, f"gyro bias {axis}", "gyro bias", "deg/s", DEG)
    for i, axis in enumerate(axes):
        put(BA + i, f"accelerometer bias {axis}", "accelerometer bias", "mg", MG_PER)
    for i, axis in enumerate(axes):
        put(SG + i, f"gyro scale {axis}", "gyro scale", "%", 0.01)
    for i, axis in enumerate(axes):
        put(SA + i, f"accelerometer scale {axis}", "accelerometer scale", "%", 0.01)
    for i, (reads, turns) in enumerate(MISALIGNED):
        put(MG + i, f"gyro misalignment {axes[reads]}{axes[turns]}", "gyro misalignment", "deg", DEG)
    for i, (one, other) in enumerate(NOT_SQUARE):
        put(MA + i, f"accelerometer {axes[one]} to {axes[other]}, not square by", "accelerometer axes", "deg", DEG)
    for i, name in enumerate(ARM):
        put(LEV + i, name, "lever arm", "m", 1.0)
    put(LAT, LATENCY, "latency", "s", 1.0, estimate.problem.latency_s)
    put(LAG, VELOCITY_LAG, "latency", "s", 1.0, estimate.problem.lag_s)
    put(WHL, "scale of the speed of the wheels", "wheels", "%", 0.01)
    for i, name in enumerate(TRAVEL):
        put(MNT + i, name, "mounting", "deg", DEG)
    return tuple(rows)


def mounting_told(mounting: Mounting, parameters: tuple[TrajectoryParameter, ...]) -> UnitMounting:
    """Return the mounting.

    It has the angles to state where the travel shows the unit turned in the vehicle.
    """
    roll, pitch, yaw = (float(one) for one in angles_of(mounting.body_from_case))
    source = "case" if mounting.source == "refused" else mounting.source
    told = UnitMounting(source, mounting.words, roll, pitch, yaw)
    travel = [one for name in TRAVEL for one in parameters if one.name == name and one.is_observable]
    if source != "found" or len(travel) < 2 or all(abs(one.value) <= NORMAL_95 * one.sigma for one in travel):
        return told
    turn = with_travel_forward(mounting.body_from_case, travel[0].value, travel[1].value)
    off_deg = float(np.degrees(np.arccos(np.prod([np.cos(np.radians(one.value)) for one in travel]))))
    first, second, third = (round(float(one), 1) % 360.0 for one in angles_of(turn))  # without signs: to be copied
    return replace(told, off_deg=off_deg, to_state_deg=(first, second, third))


def biases_of(estimates: tuple[Estimate, ...]) -> TrajectoryBiases:
    """Return the smoothed biases over time, once a second."""
    times, values, sigmas = [], [], []
    for one in estimates:
        done = one.result
        at = np.unique(np.floor(done.plan.epoch_s), return_index=True)[1]
        times.append(done.plan.epoch_s[at])
        values.append((done.linear.value[:, BG:KEPT_ROWS] + done.x[:, BG:])[at])
        sigmas.append(np.sqrt(np.maximum(done.variance[at][:, BG:], 0.0)))
    time_s, value, sigma = np.concatenate(times), np.concatenate(values), np.concatenate(sigmas)
    rows = rows_shown(time_s)
    per = np.array([DEG, DEG, DEG, MG_PER, MG_PER, MG_PER])
    value, sigma = value[rows] / per, sigma[rows] / per
    return TrajectoryBiases(
        time_s=time_s[rows],
        gyro_x_dps=value[:, 0],
        gyro_y_dps=value[:, 1],
        gyro_z_dps=value[:, 2],
        gyro_x_sigma_dps=sigma[:, 0],
        gyro_y_sigma_dps=sigma[:, 1],
        gyro_z_sigma_dps=sigma[:, 2],
        accel_x_mg=value[:, 3],
        accel_y_mg=value[:, 4],
        accel_z_mg=value[:, 5],
        accel_x_sigma_mg=sigma[:, 3],
        accel_y_sigma_mg=sigma[:, 4],
        accel_z_sigma_mg=sigma[:, 5],
    )


def outages_of(outages: Outages, factor: float) -> TrajectoryOutages:
    """Return the replayed outages, sigmas raised."""
    return TrajectoryOutages(
        start_s=outages.start_s,
        length_s=outages.length_s,
        smoothed_error_m=outages.error_m,
        smoothed_sigma_m=factor * outages.sigma_m,
        forward_end_error_m=outages.forward_end_m,
        is_inside95=outages.ratio <= factor,
    )
