"""Errors of the methods on a simulated flight, judged by the truth; honesty of sigmas."""

from dataclasses import fields

import numpy as np

from groundstation.base.angles import FloatArray, unwrap, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import frozen
from groundstation.base.units import NS_PER_S
from groundstation.methods import harmonics
from groundstation.methods.roles import HeadingOnGround
from groundstation.results.arrays.typed import found_in
from groundstation.results.roles import LETTERS, Delays, HeadingByTrack
from groundstation.simulation.deviation import deviation_truth, levelled_heading_deg
from groundstation.simulation.magnetometer import sensed_nt
from groundstation.simulation.scenario import MagnetometerSettings, Scenario
from groundstation.simulation.trajectory import ANGLE_OF_ATTACK_DEG, Trajectory, rotation_n_from_b
from groundstation.systems.magnetic.answer import MagneticResult, MethodName, PoissonParameters
from groundstation.systems.magnetic.apply import corrected_by_iron, corrected_by_table
from groundstation.systems.magnetic.arrays import MagneticSamples, MagneticTable
from groundstation.systems.magnetic.compass_table import CENTRES_DEG, filled_on_circle
from groundstation.systems.magnetic.estimate import estimate_deviation
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight

METHODS = ("none", "one_branch", "compass_table", "poisson_attitude", "constant_modulus")
JUDGED_METHODS: tuple[MethodName, ...] = ("compass_table", "poisson_attitude")
SIGMAS = (1.0, 2.0, 3.0)
UNREFUSED = MagneticSettings(modulus_condition_max=1e12, modulus_sigma_max_deg=180.0)
LIMITS = MagneticSettings()
NOT_ASSESSABLE = "not assessable"


@dataclass(frozen=True)
class JudgedMethod:
    """Comparison of one method's sigmas with its errors on one flight.

    Parameters
    ----------
    coefficient_ratio : ndarray, shape (5,)
        Error of A to E over its sigma.
    curve_inside : ndarray, shape (3,)
        Share of the headings on which what is left is within 1, 2, 3 sigma of the curve.
    curve_inside95 : float
        Within 1.96 sigma.
    curve_ratio : float
        RMS of what is left over the circle, over that of the curve's sigma.
    held_out_ratio, own_ratio : float
        Mean error on the held-out part over its sigma: against the truth with the sigmas of A to E; and as the
        estimator judges itself, by its own INS and sigma.
    held_out_rms_deg, own_rms_deg : float
        RMS error of the readings on the held-out part, against the truth and by the estimator's own INS.
    """

    coefficient_ratio: FloatArray
    curve_inside: FloatArray
    curve_inside95: float
    curve_ratio: float
    held_out_ratio: float
    own_ratio: float
    held_out_rms_deg: float
    own_rms_deg: float

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))


@dataclass(frozen=True)
class JudgedAnswer:
    """One flight: the estimator's answer, and the remaining heading error against the truth.

    Parameters
    ----------
    verdict, reason : str
        ``not assessable`` is a verdict here.
    rms_deg, shape_deg : ndarray, shape (5,)
        RMS over level flight on every heading without noise, by the methods of ``METHODS``: whole, and without its
        mean (A). NaN where a method has nothing to say; the modulus is fitted with its refusals switched off.
    is_modulus_refused : bool
        Whether the estimator's own limits refuse it.
    dip_deg, horizontal_nt : float
        Of the world.
    judged : mapping of method to JudgedMethod
    before_rms_deg : float
        Uncorrected RMS error of the readings on the held-out part.
    recommended : str
        The method to correct by.
    """

    verdict: str
    reason: str
    rms_deg: FloatArray
    shape_deg: FloatArray
    is_modulus_refused: bool
    dip_deg: float
    horizontal_nt: float
    judged: dict[str, JudgedMethod]
    before_rms_deg: float = float("nan")
    recommended: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "rms_deg", frozen(self.rms_deg))
        object.__setattr__(self, "shape_deg", frozen(self.shape_deg))


@dataclass(frozen=True)
class FlightWithTruth:
    """Flight with its truth.

    ``motion`` at the rate of the log, ``field_ned_nt`` (n, 3) of the world along it.
    """

    scenario: Scenario
    flight: Flight
    motion: Trajectory
    field_ned_nt: FloatArray

    @property
    def magnetometer(self) -> MagnetometerSettings:
        """Errors of the sensor."""
        assert self.scenario.magnetometer is not None
        return self.scenario.magnetometer


def judge(
    flown: FlightWithTruth,
    *,
    heading: HeadingByTrack | None = None,
    on_ground: HeadingOnGround | None = None,
    latencies: Delays | None = None,
    phases: Phases | None = None,
) -> JudgedAnswer:
    """Return the answer of the estimator on a flight, and the errors of its methods.

    Errors are against the truth.
    """
    middle = flown.field_ned_nt[len(flown.field_ned_nt) // 2]
    horizontal = float(np.hypot(middle[0], middle[1]))
    dip = float(np.rad2deg(np.arctan2(middle[2], horizontal)))
    try:
        result = estimate_deviation(
            flown.flight, settings=UNREFUSED, heading=heading, on_ground=on_ground, latencies=latencies, phases=phases
        )
    except NotAssessableError as error:
        nothing = np.full(len(METHODS), np.nan)
        return JudgedAnswer(NOT_ASSESSABLE, error.found, nothing, nothing, False, dip, horizontal, {})
    circle = level_circle(flown, middle)
    left = errors_deg(circle, result)
    rms = np.array([_rms(np.stack(left[name])) for name in METHODS])
    shape = np.array([_rms(np.stack([one - np.mean(one) for one in left[name]])) for name in METHODS])
    rms[METHODS.index("constant_modulus")] = np.nan  # it cannot see A
    truth = _coefficients(flown, middle)
    held_out = _held_out(flown, result)
    judged: dict[str, JudgedMethod] = {
        name: _judged(name, result, truth, circle.shown_deg, left[name][0], held_out)
        for name in JUDGED_METHODS
        if result.method(name).coefficients_sigma_deg
    }
    return JudgedAnswer(
        verdict=result.verdict,
        reason=result.verdict_reason,
        rms_deg=rms,
        shape_deg=shape,
        is_modulus_refused=is_modulus_refused(result),
        dip_deg=dip,
        horizontal_nt=horizontal,
        judged=judged,
        before_rms_deg=_rms(held_out["before"]) if held_out else float("nan"),
        recommended=result.recommended_method,
    )


@dataclass(frozen=True)
class Circle:
    """Level flight on n headings without noise.

    Magnetic heading, readings (n, 3), attitude of the INS.
    """

    magnetic_heading_deg: FloatArray
    field_nt: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray

    @property
    def shown_deg(self) -> FloatArray:
        """Uncorrected magnetic heading."""
        return levelled_heading_deg(self.field_nt, self.roll_deg, self.pitch_deg)


def level_circle(flown: FlightWithTruth, field_ned_nt: FloatArray) -> Circle:
    """Return readings of a flight's magnetometer in level flight, with the INS attitude.

    The attitude is that with which the INS would level it.
    """
    declination = float(np.rad2deg(np.arctan2(field_ned_nt[1], field_ned_nt[0])))
    heading = CENTRES_DEG
    roll, pitch = np.zeros(len(heading)), np.full(len(heading), ANGLE_OF_ATTACK_DEG)
    body_from_n = np.swapaxes(rotation_n_from_b(roll, pitch, heading + declination), 1, 2)
    reading = sensed_nt(body_from_n @ field_ned_nt, roll, np.zeros(len(heading)), flown.magnetometer)
    ins = flown.scenario.ins
    return Circle(heading, reading, roll + ins.roll_error_deg, pitch + ins.pitch_error_deg)


def errors_deg(circle: Circle, result: MagneticResult) -> dict[str, tuple[FloatArray, ...]]:
    """Return the error of each method on a circle: corrected minus true magnetic heading.

    NaN where a method has no value. One branch alone is both of them, each by itself.
    """
    shown, declination = circle.shown_deg, result.declination.value_deg
    table = found_in(result.figures, MagneticTable)
    turns = () if table is None else (table.right_turn_deg, table.left_turn_deg)
    branches = [-wrap_180(filled_on_circle(turn_deg) + declination) for turn_deg in turns]
    corrected = {
        "none": (shown,),
        "one_branch": tuple(corrected_by_table(shown, branch) for branch in branches),
        "compass_table": (corrected_by_table(shown, result.deviation_deg),),
        "poisson_attitude": (_by_iron(circle, result.poisson),),
        "constant_modulus": (_by_iron(circle, result.modulus),),
    }
    return {
        name: tuple(wrap_180(heading - circle.magnetic_heading_deg) for heading in several)
        for name, several in corrected.items()
    }


def is_modulus_refused(result: MagneticResult) -> bool:
    """Tell whether the estimator's own limits would refuse the modulus fit.

    The study fits it without them.
    """
    row = result.method("constant_modulus")
    if row.state == "refused" or row.condition_number is None:
        return True
    sigma = np.sqrt(0.5 * sum(value**2 for value in row.coefficients_sigma_deg.values()))
    return row.condition_number > LIMITS.modulus_condition_max or sigma > LIMITS.modulus_sigma_max_deg


def _by_iron(circle: Circle, parameters: PoissonParameters | None) -> FloatArray:
    if parameters is None:
        return np.full(len(circle.field_nt), np.nan)
    return corrected_by_iron(circle.field_nt, circle.roll_deg, circle.pitch_deg, parameters)


def _coefficients(flown: FlightWithTruth, field_ned_nt: FloatArray) -> FloatArray:
    """Return A to E of level flight, shape (5,), as the truth has them."""
    ins = flown.scenario.ins
    truth = deviation_truth(
        flown.magnetometer,
        field_ned_nt,
        pitch_deg=ANGLE_OF_ATTACK_DEG,
        roll_error_deg=ins.roll_error_deg,
        pitch_error_deg=ins.pitch_error_deg,
    )
    return np.array([truth.coefficients_deg[letter] for letter in LETTERS])


def _held_out(flown: FlightWithTruth, result: MagneticResult) -> dict[str, FloatArray]:
    """Return errors on the held-out part, and the uncorrected heading; empty without one.

    Errors are against the true magnetic heading.
    """
    every = found_in(result.figures, MagneticSamples)
    samples = None if every is None else every.where(every.part == "held out")
    if not samples:
        return {}
    time_s, shown = samples.time_s, samples.uncorrected_magnetic_heading_deg
    motion_s = flown.motion.time_ns / NS_PER_S
    field = [np.interp(time_s, motion_s, flown.field_ned_nt[:, axis]) for axis in (0, 1)]
    true_heading = np.interp(time_s, motion_s, unwrap(flown.motion.heading_deg))
    before = wrap_180(shown - true_heading + np.rad2deg(np.arctan2(field[1], field[0])))
    found = {"shown": shown, "before": before}
    for name in JUDGED_METHODS:
        correction = samples.error_after_deg(name) - samples.error_before_deg
        found[name] = wrap_180(before + correction)
    return found


def _judged(
    name: MethodName,
    result: MagneticResult,
    truth_deg: FloatArray,
    shown_deg: FloatArray,
    left_deg: FloatArray,
    held_out: dict[str, FloatArray],
) -> JudgedMethod:
    row = result.method(name)
    values, sigma = (
        np.array([of[letter] for letter in LETTERS]) for of in (row.coefficients_deg, row.coefficients_sigma_deg)
    )
    error = values - truth_deg
    error[0] = wrap_180(error[0])
    curve_sigma = np.sqrt(harmonics.design(shown_deg) ** 2 @ sigma**2)
    ratio = np.abs(left_deg) / curve_sigma
    nan = float("nan")
    held_ratio, held_rms = nan, nan
    if held_out:
        mean_columns = np.mean(harmonics.design(held_out["shown"]), axis=0)
        held_ratio = float(np.mean(held_out[name]) / np.sqrt(mean_columns**2 @ sigma**2))
        held_rms = _rms(held_out[name])
    own = row.held_out_mean_deg, row.held_out_mean_sigma_deg
    return JudgedMethod(
        coefficient_ratio=error / sigma,
        curve_inside=np.array([np.mean(ratio <= limit) for limit in SIGMAS]),
        curve_inside95=float(np.mean(ratio <= NORMAL_95)),
        curve_ratio=_rms(left_deg) / _rms(curve_sigma),
        held_out_ratio=held_ratio,
        own_ratio=own[0] / own[1] if own[0] is not None and own[1] else nan,
        held_out_rms_deg=held_rms,
        own_rms_deg=nan if row.held_out_after_deg is None else row.held_out_after_deg,
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
