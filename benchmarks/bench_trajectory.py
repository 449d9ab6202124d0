"""The trajectory's filter against pyins's feedback filter and INSLIB's C filter, on simulated logs with known truth.

All sides get the same increments, fixes, lever arm, start with the same errors, and noise of the unit's class. pyins
and ours estimate position, velocity, attitude, biases, scale factors and misalignments (30 states), INSLIB position to
biases (15). pyins is timed on an excerpt; INSLIB is called from a compiled loop, so that no Python is timed. "smoothed"
is our filter with its smoother, "again" a further pass about what was smoothed.

Errors are those of whole logs, once a second in their second half (pyins, which takes minutes, on the first log alone).
"squares" is the mean of squared errors over the variance that the filter states, 1 where its sigmas hold. Attitude is
that of the accelerometer's axes, made square.

Peers: ``pip install python-ins inslib`` (INSLIB is under the AGPL: for this comparison alone).
"""

import argparse
import ctypes
import os
from collections.abc import Callable
from dataclasses import dataclass

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # one core on all sides

import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
from INSLIB import Config, Ins, _core  # noqa: E402
from numba import njit  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from pyins.filters import run_feedback_filter  # noqa: E402
from pyins.inertial_sensor import EstimationModel  # noqa: E402
from pyins.measurements import NedVelocity, Position  # noqa: E402
from pyins.strapdown import compute_increments_from_imu  # noqa: E402

from benchmarks.record import ROUNDS, Book, Goal, Times, by_turns  # noqa: E402
from groundstation.base.attitude import rotation_n_from_b  # noqa: E402
from groundstation.base.geodesy import curvature_radii_m  # noqa: E402
from groundstation.base.units import MPS2_PER_G  # noqa: E402
from groundstation.simulation.imu.families import Family  # noqa: E402
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu  # noqa: E402
from groundstation.simulation.imu.imu_class import ImuClass, load_imu_class  # noqa: E402
from groundstation.simulation.imu.settings import ImuSettings, ReceiverSettings  # noqa: E402
from groundstation.systems.trajectory.forward import run_forward  # noqa: E402
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements  # noqa: E402
from groundstation.systems.trajectory.layout import Plan, Samples, fill_gaps, lay_out  # noqa: E402
from groundstation.systems.trajectory.model import Model, StartSigmas, gate  # noqa: E402
from groundstation.systems.trajectory.observations import of_gnss  # noqa: E402
from groundstation.systems.trajectory.passes import (  # noqa: E402
    NOTHING_HELD,
    OWN_ESTIMATE,
    PATTERN,
    Pass,
    Start,
    at_line,
    line_of,
    linear_room,
    make_room,
    nothing_kept,
    run_pass,
)
from groundstation.systems.trajectory.solution import TrackOfStates  # noqa: E402
from groundstation.systems.trajectory.start import quaternion_of  # noqa: E402
from groundstation.systems.trajectory.states import LEV, NAVIGATION, STATES, Gate, Noise  # noqa: E402
from groundstation.systems.trajectory.track import forward_track, smoothed_track  # noqa: E402

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
DURATION_S = 300.0
EXCERPT_S = 10.0  # timed of pyins
SHORT_REPEATS = 3  # of the sides that take some hundredths of a second
STEP_S = 0.1  # of the covariance, at pyins and INSLIB
POSITION_SIGMA_M, VELOCITY_SIGMA_MPS = 1.0, 0.05
# family, class of the unit, its rate and that of the fixes, Hz
CASES: tuple[tuple[Family, str, float, float], ...] = (
    ("drive", "mems", 100.0, 1.0),
    ("drive", "consumer", 100.0, 10.0),
    ("uav", "mems", 250.0, 5.0),
    ("uav", "consumer", 250.0, 10.0),
)
PYINS_GOAL, INSLIB_GOAL, SMOOTHER_GOAL = Goal(100.0, "at least"), Goal(1.0, "at least"), Goal(3.0)
POSITION_START_M, VELOCITY_START_MPS, LEVEL_START_DEG, HEADING_START_DEG = 1.0, 0.1, 1.0, 5.0


@dataclass(frozen=True)
class Given:
    """What all sides get: a log, where it starts with errors, and the noise of its unit in SI units."""

    flight: ImuFlight
    start: Array  # (9,) latitude and longitude deg, height m, velocity, roll, pitch, heading deg
    gyro_noise: float
    accelerometer_noise: float
    gyro_bias: float
    accelerometer_bias: float
    gyro_walk: float
    accelerometer_walk: float
    scale: float
    misalignment: float
    accelerometer_scale: float
    accelerometer_misalignment: float

    @property
    def samples(self) -> int:
        """Number of samples that a filter goes through."""
        return len(self.flight.time_s) - 1


@dataclass(frozen=True)
class Found:
    """States at samples, and their sigmas: north, east, down m; the same m/s; roll, pitch, heading deg."""

    place: Array  # (k, 3)
    velocity: Array
    attitude: Array
    sigma: Array  # (k, 9)


@dataclass(frozen=True)
class Side:
    """A filter ready to run on a log: what is timed, and what gives its states."""

    timed: Callable[[], object]
    judged: Callable[[], Found]


def given(family: Family, name: str, rate_hz: float, fixes_hz: float, seed: int, duration_s: float) -> Given:
    """Simulate a log, and draw the errors of its start."""
    receiver = ReceiverSettings(
        rate_hz=fixes_hz,
        position_white_m=POSITION_SIGMA_M,
        position_slow_m=0.0,
        position_fast_m=0.0,
        velocity_white_mps=VELOCITY_SIGMA_MPS,
        vertical_factor=1.0,
    )
    flight = simulate_imu(
        family, seed, settings=ImuSettings(duration_s=duration_s, rate_hz=rate_hz, imu_class=name, gnss=receiver)
    )
    of = load_imu_class(name)
    rng = np.random.default_rng(seed + 1_000_000)
    wrong = rng.standard_normal(9) * np.repeat(
        [POSITION_START_M, VELOCITY_START_MPS, LEVEL_START_DEG, HEADING_START_DEG], [3, 3, 2, 1]
    )
    meridian, normal = curvature_radii_m(flight.latitude_deg[0])
    start = np.array(
        [
            flight.latitude_deg[0] + np.degrees(wrong[0] / (meridian + flight.height_m[0])),
            flight.longitude_deg[0]
            + np.degrees(wrong[1] / ((normal + flight.height_m[0]) * np.cos(np.radians(flight.latitude_deg[0])))),
            flight.height_m[0] - wrong[2],
            *(flight.velocity_mps[0] + wrong[3:6]),
            flight.roll_deg[0] + wrong[6],
            flight.pitch_deg[0] + wrong[7],
            flight.heading_deg[0] + wrong[8],
        ]
    )
    return Given(flight, start, *_noise_of(of))


def _noise_of(of: ImuClass) -> tuple[float, ...]:
    """Densities, sigmas of the biases, their walks (of the same growth as the Gauss-Markov process), scale, turn."""
    dph, micro_g = np.radians(1.0 / 3600.0), 1e-6 * MPS2_PER_G
    return (
        np.radians(of.angle_random_walk_deg_per_sqrt_h) / 60.0,
        of.velocity_random_walk_mps_per_sqrt_s,
        np.hypot(of.gyro_constant_dph, of.gyro_random_dph) * dph,
        np.hypot(of.accelerometer_constant_ug, of.accelerometer_random_ug) * micro_g,
        of.gyro_random_dph * dph * np.sqrt(2.0 / of.gyro_correlation_s),
        of.accelerometer_random_ug * micro_g * np.sqrt(2.0 / of.accelerometer_correlation_s),
        1e-6 * of.gyro_scale_factor_ppm,
        1e-6 * np.hypot(of.gyro_cross_axis_ppm, of.accelerometer_cross_axis_ppm),  # against the accelerometer's axes
        1e-6 * of.accelerometer_scale_factor_ppm,
        1e-6 * of.accelerometer_cross_axis_ppm * np.sqrt(2.0),  # of two axes against each other
    )


def judged_at(of: Given) -> Indices:
    """Return the samples at which errors are judged: whole seconds of the second half, where states are given."""
    step = round(of.flight.settings.rate_hz)
    return np.arange(1 + len(of.flight.time_s) // 2 // step * step, len(of.flight.time_s), step)


def by_pyins(of: Given) -> Side:
    """Return the run of pyins."""
    flight, gnss = of.flight, of.flight.gnss
    names = [f"{kind}_{axis}" for kind in ("gyro", "accel") for axis in "xyz"]
    imu = pd.DataFrame(np.hstack([flight.delta_angle_rad, flight.delta_velocity_mps]), flight.time_s, names)
    increments = compute_increments_from_imu(imu, "increment")
    columns = ["lat", "lon", "alt", "VN", "VE", "VD", "roll", "pitch", "heading"]
    start = pd.Series(of.start, columns, name=flight.time_s[0])
    values = [gnss.latitude_deg, gnss.longitude_deg, gnss.height_m, *gnss.velocity_mps.T]
    fixes = pd.DataFrame(np.stack(values, axis=1), gnss.validity_s, columns[:6]).loc[flight.time_s[0] :]
    is_axis = np.eye(3, dtype=bool)
    cross = np.where(is_axis, of.scale, of.misalignment)
    gyro = EstimationModel(of.gyro_bias, of.gyro_noise, of.gyro_walk, cross)
    cross = np.triu(np.where(is_axis, of.accelerometer_scale, of.accelerometer_misalignment))
    accelerometer = EstimationModel(of.accelerometer_bias, of.accelerometer_noise, of.accelerometer_walk, cross)
    seen = [
        Position(fixes, POSITION_SIGMA_M, flight.lever_arm_m),
        NedVelocity(fixes, VELOCITY_SIGMA_MPS, flight.lever_arm_m),
    ]
    sigmas = POSITION_START_M, VELOCITY_START_MPS, LEVEL_START_DEG, HEADING_START_DEG

    def run() -> Found:
        done = run_feedback_filter(start, *sigmas, increments, gyro, accelerometer, seen, time_step=STEP_S)
        sigma = done.trajectory_sd.reindex(done.trajectory.index, method="ffill")
        at = judged_at(of)
        states, spread = done.trajectory.to_numpy()[at], sigma.to_numpy()[at]
        return Found(states[:, :3], states[:, 3:6], states[:, 6:9], spread)

    return Side(run, run)


def _function(name: str, *arguments: type) -> ctypes._CFuncPtr:
    """Return a function of INSLIB that a compiled loop may call."""
    address = ctypes.cast(getattr(_core._lib, name), ctypes.c_void_p).value
    return ctypes.CFUNCTYPE(ctypes.c_int, *arguments)(address)


H, P, F32 = ctypes.c_size_t, ctypes.c_void_p, ctypes.c_float  # handle, pointer
SET_IMU = _function("ins_core_set_imu", H, ctypes.c_int64, F32, P, P, P, P)
SET_POSITION = _function("ins_core_set_gnss_pos_llh", H, P, P)
SET_VELOCITY = _function("ins_core_set_gnss_vel_ned", H, P, P)
SET_ARM = _function("ins_core_set_gnss_leverarm_b", H, P)
SET_AGE = _function("ins_core_set_gnss_delay_us", H, ctypes.c_int32)
UPDATE = _function("ins_core_update", H)
PLACE = _function("ins_core_get_latlonh", H, P)
SPEED = _function("ins_core_get_velocity_ned", H, P)
ANGLES = _function("ins_core_get_rpy", H, P)
COVARIANCE = _function("ins_core_get_covariance", H, P)


@njit
def _inslib_loop(
    handle,
    time_us,
    interval,
    force,
    rate,
    force_variance,
    rate_variance,
    fix,
    age_us,
    place,
    speed,
    variances,
    arm,
    at,
    out,
):  # type: ignore[no-untyped-def]
    """Feed all samples and fixes, and read the states after the samples ``at``."""
    llh, three, square = np.empty(3), np.empty(3, np.float32), np.empty((18, 18), np.float32)
    now, judged = 0, 0
    for k in range(len(time_us)):
        SET_IMU(
            handle,
            time_us[k],
            interval[k],
            force[k].ctypes,
            rate[k].ctypes,
            force_variance.ctypes,
            rate_variance.ctypes,
        )
        if now < len(fix) and fix[now] == k:
            SET_POSITION(handle, place[now].ctypes, variances[0].ctypes)
            SET_VELOCITY(handle, speed[now].ctypes, variances[1].ctypes)
            SET_ARM(handle, arm.ctypes)
            SET_AGE(handle, age_us[now])
            now += 1
        UPDATE(handle)
        if judged < len(at) and at[judged] == k:
            PLACE(handle, llh.ctypes)
            out[judged, :3] = llh
            SPEED(handle, three.ctypes)
            out[judged, 3:6] = three
            ANGLES(handle, three.ctypes)
            out[judged, 6:9] = three
            COVARIANCE(handle, square.ctypes)
            for i in range(9):
                out[judged, 9 + i] = square[i, i]
            judged += 1


def by_inslib(of: Given) -> Side:
    """Return the run of INSLIB's bare filter, without the rules for standstill, gates and waits of a live receiver."""
    flight, gnss = of.flight, of.flight.gnss
    step = flight.interval_s[1:, None]
    time_us = np.rint(1e6 * flight.time_s[1:]).astype(np.int64)
    later = gnss.validity_s > flight.time_s[0]
    fix = np.searchsorted(flight.time_s[1:], gnss.validity_s[later])
    kept = fix < len(time_us)
    fix, valid_s = fix[kept], gnss.validity_s[later][kept]
    age_us = np.rint(1e6 * (flight.time_s[1:][fix] - valid_s)).astype(np.int32)
    place = np.stack([np.radians(gnss.latitude_deg), np.radians(gnss.longitude_deg), gnss.height_m], axis=1)[later][
        kept
    ]
    variances = np.repeat(np.float32([[POSITION_SIGMA_M**2], [VELOCITY_SIGMA_MPS**2]]), 3, axis=1)
    config = Config(
        time_us=round(1e6 * flight.time_s[0]),
        lat_rad=np.radians(of.start[0]),
        lon_rad=np.radians(of.start[1]),
        h_m=of.start[2],
        init_vel_ned=tuple(of.start[3:6]),
        rpy_init_rad=tuple(np.radians(of.start[6:9])),
        pos_init_stddev_m=POSITION_START_M,
        vel_init_stddev_mps=VELOCITY_START_MPS,
        rpy_init_stddev_rad=tuple(np.radians([LEVEL_START_DEG, LEVEL_START_DEG, HEADING_START_DEG])),
        acc_bias_init_stddev_mps2=of.accelerometer_bias,
        gyr_bias_init_stddev_rps=of.gyro_bias,
        acc_bias_pred_stddev_mps2_sqrts=of.accelerometer_walk,
        gyr_bias_pred_stddev_rps_sqrts=of.gyro_walk,
        kalman_update_dt_sec=STEP_S,
        auto_init=False,
        auto_zupt_disable=True,
        gnss_init_dwell_disable=True,
        gnss_stop_disable=True,
        gnss_pos_decimation=1,
        gnss_min_delay_ms=-1,
        gnss_acc_envelope_tau_sec=-1.0,
    )
    at = judged_at(of) - 1
    out = np.zeros((len(at), 18))
    fed = (
        time_us,
        step[:, 0].astype(np.float32),
        (flight.delta_velocity_mps[1:] / step).astype(np.float32),
        (flight.delta_angle_rad[1:] / step).astype(np.float32),
        np.full(3, of.accelerometer_noise**2, np.float32),
        np.full(3, of.gyro_noise**2, np.float32),
        fix.astype(np.int64),
        age_us,
        place,
        gnss.velocity_mps[later][kept].astype(np.float32),
        variances,
        flight.lever_arm_m.astype(np.float32),
        at,
        out,
    )

    def run() -> Found:
        with Ins(config) as peer:
            _inslib_loop(peer._h, *fed)
        place = np.stack([np.degrees(out[:, 0]), np.degrees(out[:, 1]), out[:, 2]], axis=1)
        sigma = np.sqrt(out[:, 9:])
        sigma[:, 6:] = np.degrees(sigma[:, 6:])
        return Found(place, out[:, 3:6].copy(), np.degrees(out[:, 6:9]), sigma)

    return Side(run, run)


@dataclass(frozen=True)
class OurPass:
    """What our loops take."""

    samples: Samples
    plan: Plan
    noise: Noise
    rules: Gate
    start: Start


def prepared(of: Given) -> OurPass:
    """Lay out our pass: constants that the peers do not estimate have no variance."""
    flight, gnss = of.flight, of.flight.gnss
    parts = flight.time_s[1:], flight.interval_s[1:], flight.delta_angle_rad[1:], flight.delta_velocity_mps[1:]
    samples = fill_gaps(ImuIncrements(*parts))
    position, velocity = np.full((2, len(gnss.time_s), 3), [[[POSITION_SIGMA_M]], [[VELOCITY_SIGMA_MPS]]])
    fixes = GnssFixes(
        gnss.validity_s,
        gnss.latitude_deg,
        gnss.longitude_deg,
        gnss.height_m,
        gnss.velocity_mps,
        position,
        velocity,
        gnss.is_precise,
    )
    micro_g_of = 1e3 / MPS2_PER_G
    model = Model(
        gyro_noise_deg_rth=float(np.degrees(of.gyro_noise) * 60.0),
        accel_noise_mps_rth=of.accelerometer_noise * 60.0,
        gyro_walk_dps_rth=float(np.degrees(of.gyro_walk) * 60.0),
        accel_walk_mg_rth=of.accelerometer_walk * 60.0 * micro_g_of,
        position_scale=1.0,
        position_floor_m=0.0,
        velocity_floor_mps=0.0,
        slow_scale=0.0,
        fast_scale=0.0,
        jitter_s=0.0,
        gyro_imperfection=1.0,
        accel_imperfection=1.0,
    )
    noise = model.noise(np.full(3, POSITION_SIGMA_M))
    sigmas = StartSigmas(
        gyro_bias_dps=float(np.degrees(of.gyro_bias)),
        accel_bias_mg=of.accelerometer_bias * micro_g_of,
        gyro_scale=of.scale,
        misalignment_deg=float(np.degrees(of.misalignment)),
        accel_scale=of.accelerometer_scale,
        accel_square_deg=float(np.degrees(of.accelerometer_misalignment)),
        lever_m=0.0,
    )
    variances = sigmas.variances(noise, model, has_latency=False, has_slip=False, has_baro=False, has_wheels=False)
    level, heading = np.radians([LEVEL_START_DEG, HEADING_START_DEG])
    variances[:NAVIGATION] = np.square([*[POSITION_START_M] * 3, *[VELOCITY_START_MPS] * 3, level, level, heading])
    value = np.zeros(STATES)
    value[LEV : LEV + 3] = flight.lever_arm_m
    quaternion = quaternion_of(rotation_n_from_b(of.start[None, 6:])[0])
    nav = np.concatenate([np.radians(of.start[:2]), of.start[2:6], quaternion])
    start = Start(nav, value, np.diag(variances), np.zeros(STATES))
    plan = lay_out(samples, model.weighted(of_gnss(fixes)), float(flight.time_s[0]), 0.0)
    return OurPass(samples, plan, noise, gate(), start)


def _judged(of: Given, run: OurPass, done: Pass, track: Callable[[Samples, Pass, Indices], TrackOfStates]) -> Found:
    states = track(run.samples, done, judged_at(of) - 1)
    return Found(
        np.stack([states.latitude_deg, states.longitude_deg, states.height_m], axis=1),
        states.velocity_mps,
        np.stack([states.roll_deg, states.pitch_deg, states.heading_deg], axis=1),
        np.concatenate([states.position_sigma_m, states.velocity_sigma_mps, states.attitude_sigma_deg], axis=1),
    )


def _once(run: OurPass) -> Pass:
    return run_pass(run.samples, run.plan, run.noise, run.rules, run.start)


def _again(run: OurPass, done: Pass) -> Pass:
    line = line_of(done)
    return run_pass(run.samples, run.plan, run.noise, run.rules, at_line(done.start, line), line)


def by_us(of: Given) -> Side:
    """Return the run of our filter alone."""
    run = prepared(of)
    linear = linear_room(run.plan)

    def filtered() -> float:
        now, room, epochs = run.start.now(), make_room(run.start.prior), len(run.plan.epoch_s)
        parts = run.samples.imu, run.plan.schedule, run.plan.seen, run.noise, run.rules, PATTERN, NOTHING_HELD
        return run_forward(*parts, OWN_ESTIMATE, True, True, 0, epochs, now, room, linear, nothing_kept())

    return Side(filtered, lambda: _judged(of, run, _once(run), forward_track))


def by_us_smoothed(of: Given) -> Side:
    """Return the run of our filter with its smoother."""
    run = prepared(of)
    return Side(lambda: _once(run), lambda: _judged(of, run, _once(run), smoothed_track))


def by_us_again(of: Given) -> Side:
    """Return a pass about the smoothed trajectory; two of them are judged."""
    run = prepared(of)
    first = _once(run)
    return Side(lambda: _again(run, first), lambda: _judged(of, run, _again(run, _again(run, first)), smoothed_track))


SIDES: dict[str, Callable[[Given], Side]] = {
    "pyins": by_pyins,
    "INSLIB": by_inslib,
    "ours": by_us,
    "smoothed": by_us_smoothed,
    "again": by_us_again,
}


def speeds(book: Book, what: str, case: tuple[Family, str, float, float]) -> None:
    """Record how our filter compares in speed, and what the smoother and another pass add."""
    whole, excerpt = (given(*case, 1, length) for length in (DURATION_S, EXCERPT_S))
    logs = {who: excerpt if who == "pyins" else whole for who in SIDES}
    often = {who: SHORT_REPEATS for who in SIDES if who != "pyins"}
    times = by_turns({who: make(logs[who]).timed for who, make in SIDES.items()}, ROUNDS, often)
    for who, goal, package in (("pyins", PYINS_GOAL, "python-ins"), ("INSLIB", INSLIB_GOAL, "inslib")):
        factor = whole.samples / logs[who].samples
        peer = Times(*(tuple(factor * one for one in side) for side in (times[who].processor_s, times[who].clock_s)))
        asked = {"goal": goal, "is_times": True, "distribution": package}
        book.against(f"trajectory filter, {what}", times["ours"], peer, who, **asked)
    for who, words in (("smoothed", "filter with smoother"), ("again", "another pass about the smoothed trajectory")):
        book.against(f"{words}, {what}", times[who], times["ours"], "our filter alone", goal=SMOOTHER_GOAL)


def words_of(case: tuple[Family, str, float, float]) -> str:
    """Name a case."""
    family, name, rate_hz, fixes_hz = case
    return f"{family}, {name} unit at {rate_hz:g} Hz, fixes at {fixes_hz:g} Hz"


def main() -> None:
    """Measure and record."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    with Book("trajectory") as book:
        for case in CASES:
            speeds(book, words_of(case), case)


if __name__ == "__main__":
    main()
