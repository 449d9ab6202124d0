"""Outputs to the motors of a multirotor, and the one that a lost attitude points to.

A motor without thrust lets its arm sink, and the controller commands it up and the one opposite down. So the output
that stands high, alone and steadily, is that of the suspect.

Source: ArduPilot, AP_MotorsMulticopter.cpp (output_to_pwm, thrust_to_actuator: MOT_SPIN_MIN to MOT_SPIN_MAX of the
range MOT_PWM_MIN to MOT_PWM_MAX, or of the throttle channel where they are 0), AP_MotorsMatrix.cpp
(check_for_failed_motor: filtered thrust of the highest motor against the mean of all), 3.6 to 4.6; AP_MotorsMulticopter
of 3.3 (THR_MIN, MOT_THST_MAX); PX4, mixer_module (PWM_MAIN_FUNCn), THR_MDL_FAC.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.systems.health.answer import AttitudeLoss, MotorOutput
from groundstation.systems.health.logged import FloatArray, named
from groundstation.systems.health.px4_topics import topic, topics
from groundstation.tables.parameters import Parameters, parameters_of
from groundstation.tables.table import Flight

OUTPUTS = 16
MOTORS = (*range(33, 41), *range(82, 86))  # SERVOn_FUNCTION: motors 1 to 12
PX4_MOTORS = range(101, 113)  # PWM_MAIN_FUNCn: motors 1 to 12
MOTORS_OF_TYPE = {2: 4, 13: 6, 14: 8}  # MAV_TYPE of a multirotor: its motors are the first outputs
HELICOPTERS = (6.0, 11.0, 13.0)  # FRAME_CLASS whose "motors" are servos of the swash plate
THR_MIN = 130.0  # thousandths of the throttle's range, the default until 3.3
EXPO = 0.65  # default of MOT_THST_EXPO
FULL = 0.98  # of the travel, where an output counts as at its end
HALF = 0.5
LEAST_MOTORS = 4
JUDGED_S = 1.0  # after the loss; ArduPilot filters with 0.5 s
LEAST_ROWS = 4
UNBALANCED = 1.5  # highest thrust over the mean of all, as ArduPilot calls thrust unbalanced
ALONE = 1.25  # ours: highest thrust over the next; two motors alike point to a side, not to a motor
STEADY = 0.85  # ours: of the time above the mean; what tumbles is commanded to and fro
ALL_FULL = 0.9  # mean thrust of all


@dataclass(frozen=True, eq=False)
class Motor:
    """One motor's output, with what it may be at least and at most in flight."""

    number: int
    value: FloatArray
    low: float
    high: float

    @property
    def travel(self) -> FloatArray:
        """Share of its travel, shape (n,)."""
        return (self.value - self.low) / (self.high - self.low)


@dataclass(frozen=True, eq=False)
class Motors:
    """Outputs of all motors along time, and the exponent of their thrust."""

    time_ns: Int64Array
    each: tuple[Motor, ...]
    unit: str
    source: str
    expo: float

    def thrust(self) -> FloatArray:
        """Return the thrust commanded of each, of its greatest, shape (n, motors)."""
        share = np.clip(np.column_stack([one.travel for one in self.each]), 0.0, 1.0)
        return np.asarray((1.0 - self.expo) * share + self.expo * share**2)


def motors_of(flight: Flight) -> Motors | None:
    """Return the outputs to the motors.

    None where the log does not tell which they are, or their limits.
    """
    return _ardupilot(flight) if "raw.RCOU" in flight else _px4(flight)


def _ardupilot(flight: Flight) -> Motors | None:
    parameters, table = parameters_of(flight), flight["raw.RCOU"]
    ends = ardupilot_ends(parameters)
    if ends is None or parameters.value("FRAME_CLASS") in HELICOPTERS:
        return None
    each = []
    for number in range(1, OUTPUTS + 1):
        field = named(table, f"C{number}", f"Ch{number}", f"Chan{number}")
        if field and is_motor(parameters, number):
            pulse = table.values(field)
            each.append(Motor(number, np.where((pulse > 500.0) & (pulse < 2500.0), pulse, np.nan), *ends))
    expo = parameters.value("MOT_THST_EXPO", "Q_M_THST_EXPO")
    expo = EXPO if expo is None else float(np.clip(expo, 0.0, 1.0))
    return Motors(table.time_ns, tuple(each), "us", "raw.RCOU", expo) if each else None


def is_motor(parameters: Parameters, number: int) -> bool:
    """Tell whether an output is one of a motor."""
    function = parameters.value(f"SERVO{number}_FUNCTION", f"RC{number}_FUNCTION")
    return function is not None and int(function) in MOTORS


def ardupilot_ends(parameters: Parameters) -> tuple[float, float] | None:
    """Return what a motor's output is at least and at most in flight.

    None where the log has neither its range nor that of the throttle.
    """
    low, high = parameters.value("MOT_PWM_MIN", "Q_M_PWM_MIN"), parameters.value("MOT_PWM_MAX", "Q_M_PWM_MAX")
    if not low or not high or high <= low:
        channel = int(parameters.value("RCMAP_THROTTLE") or 3)
        low, high = parameters.value(f"RC{channel}_MIN"), parameters.value(f"RC{channel}_MAX")
    if not low or not high or high <= low:
        return None
    least, most = parameters.value("MOT_SPIN_MIN", "Q_M_SPIN_MIN"), parameters.value("MOT_SPIN_MAX", "Q_M_SPIN_MAX")
    if least is not None and most is not None and 0.0 <= least < most <= 1.0:
        return float(int(low + least * (high - low))), float(int(low + most * (high - low)))  # whole microseconds
    thr_min = parameters.value("THR_MIN")
    least = low + (THR_MIN if thr_min is None else thr_min) / 1000.0 * (high - low)
    most = parameters.value("MOT_THST_MAX")
    return (least, least + (most if most and 0.5 <= most <= 1.0 else 1.0) * (high - least)) if least < high else None


def _px4(flight: Flight) -> Motors | None:
    parameters = parameters_of(flight)
    expo = float(np.clip(parameters.value("THR_MDL_FAC") or 0.0, 0.0, 1.0))
    commanded = topic(flight, "actuator_motors")
    if commanded is not None:
        each = [
            Motor(number, commanded.values(f"control[{number - 1}]"), 0.0, 1.0)
            for number in range(1, 13)
            if commanded.has(f"control[{number - 1}]")
        ]
        if each:
            return Motors(commanded.time_ns, tuple(each), "", commanded.source("control"), expo)
    kind = topic(flight, "vehicle_status")
    types = kind.values("system_type") if kind is not None else np.zeros(0)
    count = MOTORS_OF_TYPE.get(int(types[np.isfinite(types)][-1]), 0) if np.isfinite(types).any() else 0
    for one in topics(flight, "actuator_outputs"):
        each = list(_px4_pulses(parameters, [one.values(f"output[{place}]") for place in range(OUTPUTS)], count))
        if each:
            return Motors(one.time_ns, tuple(each), "us", one.source("output"), expo)
    return None


def _px4_pulses(parameters: Parameters, values: list[FloatArray], count: int) -> Iterator[Motor]:
    """Yield the motors among PWM outputs.

    By their functions (from 1.13), else the first of a multirotor.
    """
    functions = [parameters.value(f"PWM_MAIN_FUNC{number}") for number in range(1, OUTPUTS + 1)]
    has_functions = any(one is not None for one in functions)
    for number, (value, function) in enumerate(zip(values, functions, strict=True), start=1):
        is_one = function is not None and int(function) in PX4_MOTORS if has_functions else number <= count
        low = parameters.value(f"PWM_MAIN_MIN{number}", "PWM_MAIN_MIN", "PWM_MIN")
        high = parameters.value(f"PWM_MAIN_MAX{number}", "PWM_MAIN_MAX", "PWM_MAX")
        if is_one and low and high and high > low and np.any(value > 500.0):
            yield Motor(number, np.where((value > 500.0) & (value < 2500.0), value, np.nan), low, high)


def at_limit(motors: Motors) -> FloatArray:
    """Return 1 where a motor is at a limit, else 0, NaN where nothing is known.

    Its lowest counts while another is beyond half. All low together are a descent, and no limit of control.
    """
    share = np.column_stack([one.travel for one in motors.each])
    known = np.isfinite(share).any(axis=1)
    share = np.where(np.isfinite(share), share, HALF)
    is_low = (share <= 1.0 - FULL).any(axis=1) & (share > HALF).any(axis=1)
    return np.where(known, (share >= FULL).any(axis=1) | is_low, np.nan)


def at_the_loss(flight: Flight, motors: Motors | None, lost_ns: int) -> AttitudeLoss:
    """Return what the motors were commanded in the second after control of attitude was lost."""
    start_s = float(flight.seconds(np.array([lost_ns]))[0])
    if motors is None or len(motors.each) < LEAST_MOTORS:
        return AttitudeLoss(start_s)
    rows = (motors.time_ns >= lost_ns) & (motors.time_ns < lost_ns + round(JUDGED_S * NS_PER_S))
    rows &= np.isfinite(np.column_stack([one.value for one in motors.each])).all(axis=1)
    if np.count_nonzero(rows) < LEAST_ROWS:
        return AttitudeLoss(start_s, unit=motors.unit, source=motors.source)
    thrust = motors.thrust()[rows]
    step_s = JUDGED_S / len(thrust)
    outputs = tuple(
        MotorOutput(
            number=one.number,
            low=one.low,
            high=one.high,
            mean=float(one.value[rows].mean()),
            thrust=float(thrust[:, place].mean()),
            at_low_s=float((one.travel[rows] <= 1.0 - FULL).sum() * step_s),
            at_high_s=float((one.travel[rows] >= FULL).sum() * step_s),
        )
        for place, one in enumerate(motors.each)
    )
    return AttitudeLoss(start_s, JUDGED_S, motors.unit, motors.source, outputs, *_suspect(outputs, thrust))


def _suspect(outputs: tuple[MotorOutput, ...], thrust: FloatArray) -> tuple[int | None, bool]:
    """Return the output whose motor is suspect, None without one, and whether all are at full."""
    mean = np.array([one.thrust for one in outputs])
    order = np.argsort(mean)
    highest, second = order[-1], order[-2]
    if mean.mean() > ALL_FULL:
        return None, True
    is_steady = np.mean(thrust[:, highest] > thrust.mean(axis=1)) >= STEADY
    is_high = mean[highest] >= UNBALANCED * mean.mean() and mean[highest] >= ALONE * mean[second]
    return (outputs[int(highest)].number if is_high and is_steady else None), False
