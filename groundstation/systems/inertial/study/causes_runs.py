"""Flights of the study of errors by cause: simulated with known constants, and judged."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Literal
from zlib import crc32

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.methods.ins_noise import load_class
from groundstation.simulation.inertial_family import ORDINARY_RECEIVER, GnssErrorModel, draw_gnss_errors
from groundstation.simulation.ins_class import InsClass, draw_instrument, load_ins_class
from groundstation.simulation.ins_draw import DPH, MICRO_G, draw_sensor_errors
from groundstation.simulation.ins_errors import InsErrors, SensorErrors, TrueMotion, propagate
from groundstation.simulation.routes import Route, RouteKind, draw_route
from groundstation.systems.inertial.cause_answer import CausesResult, Within95
from groundstation.systems.inertial.cause_fit import (
    AZ,
    AZ_DRIFT,
    BIAS_FORWARD,
    BIAS_RIGHT,
    GYRO_E,
    GYRO_N,
    PLACE_E,
    PLACE_N,
    SPEED_E,
    SPEED_N,
    TILT_E,
    TILT_N,
    CauseFit,
    fit_causes,
)
from groundstation.systems.inertial.cause_legs import straight_legs
from groundstation.systems.inertial.cause_wave import flight_wave
from groundstation.systems.inertial.causes import CauseRow, assess_causes, parameter_rows, share_rows
from groundstation.systems.inertial.coupled import AZIMUTH, CHANNELS, FORWARD_BIAS, RIGHT_BIAS, SIZE
from groundstation.systems.inertial.differences import InsDifferences, drag_per_s
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, initial_of, run_filter
from groundstation.systems.inertial.model import DRIFT, RANDOM_DRIFT, TILT, VELOCITY, ChannelModel
from groundstation.systems.inertial.units_answer import Measured

Broken = Literal["", "slow GNSS", "warm-up", "gravity"]
Progress = Callable[[str], None]

FIRST_SEED, SEEDS_PER_STUDY = 70_000, 10
DURATION_S = 16_000.0
SLOW_RECEIVER = GnssErrorModel(2.0, 10.0, 300.0, 0.03, 0.06, 300.0)
WARM_UP_DPH, WARM_UP_S = 0.03, 2400.0  # a gyro that settles from it, by exponential
GRAVITY_ARCSEC, GRAVITY_KM = 20.0, 100.0  # deflection over mountains


@dataclass(frozen=True)
class CauseCase:
    """Flights of one cell: class, route, instruments of their own or not, what is broken."""

    name: str
    ins: str
    route: RouteKind
    each_its_own: bool = False
    broken: Broken = ""


CASES: tuple[CauseCase, ...] = (
    CauseCase("i21", "i-21", "norilsk_moscow"),
    CauseCase("straight", "navigation", "straight"),
    CauseCase("manoeuvring", "navigation", "manoeuvring"),
    CauseCase("own_straight", "navigation", "straight", each_its_own=True),
    CauseCase("out_and_back", "navigation", "out_and_back", each_its_own=True),
    CauseCase("dogleg", "navigation", "dogleg", each_its_own=True),
    CauseCase("racetrack", "navigation", "racetrack", each_its_own=True),
    CauseCase("late_survey", "navigation", "late_survey", each_its_own=True),
    CauseCase("slow GNSS", "navigation", "dogleg", broken="slow GNSS"),
    CauseCase("warm-up", "navigation", "dogleg", broken="warm-up"),
    CauseCase("gravity", "navigation", "dogleg", broken="gravity"),
)


@dataclass(frozen=True)
class CauseCell:
    """Value of the answer against the truth: error, and the ends of its interval."""

    quantity: str
    error: float
    low: float
    high: float

    @property
    def is_inside(self) -> bool:
        """The truth is in the interval."""
        return self.low <= 0.0 <= self.high


@dataclass(frozen=True)
class CauseOutcome:
    """One judged flight of a cell."""

    case: str
    run: int
    sentence: str
    cells: tuple[CauseCell, ...]


@dataclass(frozen=True)
class FlownCauses:
    """Simulated flight with its truth: constants of the INS, errors, what GNSS showed."""

    ins: InsClass
    route: Route
    sensors: SensorErrors
    errors: InsErrors
    gyro_radps: FloatArray
    accelerometer_mps2: FloatArray
    differences: InsDifferences
    run: ChannelsRun


def run_causes(
    runs: int, seed: int, progress: Progress | None = None, *, minutes: float | None = None
) -> tuple[CauseOutcome, ...]:
    """Fly and judge ``runs`` flights of every cell in turns, fewer where the minutes are over."""
    end_s = time.monotonic() + 60.0 * minutes if minutes is not None else float("inf")
    found = []
    for run, (place, case) in _in_turns(runs):
        if run and time.monotonic() > end_s:
            break
        outcome = judge_causes(case, FIRST_SEED + SEEDS_PER_STUDY * seed, place, run)
        found.append(outcome)
        if progress:
            progress(f"{case.name} run {run}: {outcome.sentence}")
    return tuple(found)


def _in_turns(runs: int) -> Iterator[tuple[int, tuple[int, CauseCase]]]:
    for run in range(runs):
        for case in enumerate(CASES):
            yield run, case


def judge_causes(case: CauseCase, seed: int, place: int, run: int, *, duration_s: float = DURATION_S) -> CauseOutcome:
    """Simulate run ``run`` of a cell, and hold every interval of the answer against the truth."""
    flown = fly_causes(case, np.random.SeedSequence((seed, place, run)), duration_s)
    answer, fit = assess_causes(flown.differences, flown.run, 0.0), fit_causes(flown.differences, flown.run)
    return CauseOutcome(case.name, run, answer.sentence, tuple(_cells(flown, answer, fit)))


def fly_causes(case: CauseCase, seed: np.random.SeedSequence, duration_s: float = DURATION_S) -> FlownCauses:
    """Simulate a flight with its INS and GNSS, and run the filter of the two channels."""

    def streams(name: str) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(seed.entropy, spawn_key=(crc32(name.encode()),)))

    time_s = np.arange(round(duration_s) + 1, dtype=np.float64)
    route, ins = draw_route(case.route, time_s, streams("route")), load_ins_class(case.ins)
    if case.each_its_own:
        ins = draw_instrument(ins, streams("instrument"))
    if case.broken == "gravity":
        ins = replace(ins, deflection_arcsec=GRAVITY_ARCSEC, deflection_correlation_km=GRAVITY_KM)
    sensors = draw_sensor_errors(ins, route.motion, streams, body_fixed=ins.is_strapdown)
    if case.broken == "warm-up":
        size = DPH * WARM_UP_DPH * streams("warm-up").standard_normal(3)
        ramp = np.exp(-time_s / WARM_UP_S)[:, None] * size
        sensors = replace(sensors, gyro_radps=sensors.gyro_radps + ramp[None])
    errors = propagate(route.motion, sensors, body_fixed=ins.is_strapdown)
    fixed = streams("ins constants").standard_normal(40)  # as draw_sensor_errors has them
    receiver = SLOW_RECEIVER if case.broken == "slow GNSS" else ORDINARY_RECEIVER
    differences = _differences(route, errors, receiver, streams("gnss"))
    noise, motion = load_class(case.ins), route.motion
    model = ChannelModel.at(float(np.mean(motion.latitude_deg)), float(np.mean(motion.altitude_m)), noise.beta_per_s)
    epochs = differences.epochs
    return FlownCauses(
        *(ins, route, sensors, errors),
        DPH * ins.gyro_constant_dph * fixed[0:3],
        MICRO_G * ins.accelerometer_constant_ug * fixed[6:9],
        differences,
        run_filter(epochs, model, noise, initial=initial_of(epochs, noise)),
    )


def _differences(route: Route, errors: InsErrors, receiver: GnssErrorModel, rng: np.random.Generator) -> InsDifferences:
    motion, n = route.motion, len(route.motion.time_s)
    position, velocity = draw_gnss_errors(receiver, n, 1.0, rng)
    ground = _ground_mps(motion)
    latitude, altitude = motion.latitude_deg[0], motion.altitude_m[0]
    epochs = DifferenceEpochs(
        motion.time_s,
        errors.position_m[0] - position,
        errors.velocity_mps[0] - velocity,
        drag_per_s(latitude, altitude, ground),
        np.zeros(n, dtype=bool),
    )
    place = (latitude, route.longitude_deg, altitude)
    return InsDifferences("ins", "gnss", epochs, *place, ground, 0.0, (), motion.heading_deg[0])


def _ground_mps(motion: TrueMotion) -> FloatArray:
    return np.stack([motion.velocity_north_mps[0], motion.velocity_east_mps[0]], axis=1)


def true_constants(flown: FlownCauses, fit: CauseFit) -> FloatArray:
    """Return the constants of the simulated INS in the order of a fit, shape (p,)."""
    row = int(np.argmin(np.abs(flown.route.motion.time_s - fit.time_s[0])))
    out = np.zeros(len(fit.value))
    out[[PLACE_N, PLACE_E]] = flown.errors.position_m[0, row]
    out[[SPEED_N, SPEED_E]] = flown.errors.velocity_mps[0, row]
    out[[TILT_N, TILT_E]] = flown.errors.tilt_rad[0, row]
    out[[AZ, AZ_DRIFT]] = flown.errors.azimuth_rad[0, row], flown.gyro_radps[2]
    out[[GYRO_N, GYRO_E]] = flown.gyro_radps[1], -flown.gyro_radps[0]
    out[[BIAS_FORWARD, BIAS_RIGHT]] = flown.accelerometer_mps2[:2]
    return out


def _true_end(flown: FlownCauses, fit: CauseFit) -> FloatArray:
    """Return the states of the coupled model at the last epoch, shape (16,)."""
    row = int(np.argmin(np.abs(flown.route.motion.time_s - fit.time_s[-1])))
    x, gyro = np.zeros(SIZE), flown.sensors.gyro_radps[0, row]
    x[CHANNELS[:, VELOCITY]] = flown.errors.velocity_mps[0, row]
    x[CHANNELS[:, TILT]] = flown.errors.tilt_rad[0, row]
    x[CHANNELS[:, DRIFT]] = flown.gyro_radps[1], -flown.gyro_radps[0]
    x[CHANNELS[:, RANDOM_DRIFT]] = gyro[1] - flown.gyro_radps[1], flown.gyro_radps[0] - gyro[0]
    x[AZIMUTH] = flown.errors.azimuth_rad[0, row]
    x[[FORWARD_BIAS, RIGHT_BIAS]] = flown.accelerometer_mps2[:2]
    return x


def _cells(flown: FlownCauses, answer: CausesResult, fit: CauseFit) -> Iterator[CauseCell]:
    true = true_constants(flown, fit)
    rows = {one.name: one for one in parameter_rows(fit, is_strapdown=answer.is_strapdown)}
    for one in answer.parameters:
        yield _of_half(one.name, one.value - _applied(rows[one.name], true), one.half95)
    explained = share_rows(fit, _true_means(flown, fit))
    shares = {name: float(row @ true) for name, row in explained.items()}
    shares["unexplained"] = 1.0 - sum(shares.values())
    for share in answer.shares:
        if share.name != "reset":
            yield _of(f"share {share.name}", share.share, shares[share.name])
    yield _of("start amplitude", answer.start_mps, float(np.linalg.norm(fit.start_rows @ true)))
    start, end = fit.schuler_rows @ true, fit.end_states @ _true_end(flown, fit)
    flown_mps = flight_wave(fit.time_s, _true_means(flown, fit), fit.schuler_radps)
    for place, wave in enumerate(answer.schuler):
        if wave.flight_mps is not None and flown_mps is not None:
            yield _of("amplitude over the flight", wave.flight_mps, flown_mps.amplitude_mps[place].value)
        a, b = start[2 * place : 2 * place + 2]
        yield _of("amplitude", wave.amplitude_mps, float(np.hypot(a, b)))
        yield _of("amplitude at the end", wave.end_mps, float(np.hypot(*end[2 * place : 2 * place + 2])))
        yield _of("offset", wave.offset_mps, float(-fit.radius_m * fit.drift_rows[place] @ true))
        if wave.phase_deg is not None:
            phase = wave.phase_deg
            middle = phase.value
            apart = float(wrap_180(np.rad2deg(np.arctan2(b, a)) - middle))
            yield CauseCell("phase", -apart, phase.low95 - middle - apart, phase.high95 - middle - apart)
    yield from _legs(flown, answer)


def _true_means(flown: FlownCauses, fit: CauseFit) -> FloatArray:
    """Return the velocity errors at the epochs of a fit, shape (n, 2)."""
    time_s = flown.route.motion.time_s
    return np.stack([np.interp(fit.time_s, time_s, part) for part in flown.errors.velocity_mps[0].T], axis=1)


def _legs(flown: FlownCauses, answer: CausesResult) -> Iterator[CauseCell]:
    legs, _left_out = straight_legs(flown.differences, flown.errors.position_m[0], flown.errors.velocity_mps[0])
    names = ("along_rate_nmiph", "across_rate_nmiph", "along_change_mps", "across_change_mps")
    for told, true in zip(answer.legs, legs, strict=True):
        for name in names:
            value, truth = getattr(told, name), getattr(true, name)
            if isinstance(value, Measured) and isinstance(truth, Measured):
                kind = "leg rate" if "rate" in name else "leg change"
                yield _of_half(kind, value.value - truth.value, value.half95)


def _applied(row: CauseRow, true: FloatArray) -> float:
    return row.factor * float(row.row @ true)


def _of(quantity: str, told: Within95, true: float) -> CauseCell:
    return CauseCell(quantity, told.value - true, told.low95 - true, told.high95 - true)


def _of_half(quantity: str, error: float, half95: float) -> CauseCell:
    return CauseCell(quantity, error, error - half95, error + half95)


def quantities(outcomes: Sequence[CauseOutcome]) -> tuple[str, ...]:
    """Return the quantities in the order of the answer."""
    return tuple(dict.fromkeys(cell.quantity for one in outcomes for cell in one.cells))
