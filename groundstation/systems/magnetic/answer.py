"""Answer of the magnetic estimator: deviation found in flight, with its sigma.

The answer also tells what the correction leaves over.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from groundstation.base.angles import FloatArray
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.gates import Gate
from groundstation.results.roles import LETTERS, CompassCoefficients

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

MagneticVerdict = Literal["accept", "reject", "undecided"]
MethodName = Literal["compass_table", "poisson_attitude", "constant_modulus"]
ConditionName = Literal["pitch", "ground", "gain"]
SourceName = Literal["taxi", "ground run", "turns", "states"]
MethodState = Literal["fitted", "refused"]
TurnState = Literal["used", "rejected"]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
METHOD_TITLES: dict[MethodName, str] = {
    "compass_table": "branch table",
    "poisson_attitude": "iron fit",
    "constant_modulus": "modulus fit",
}
ADVISORY = "Advisory, not a release to service."
DEVIATION_CSV, STEER_CARD = "deviation.csv", "steer_card.pdf"  # in the folder of a flight that has one


def vector_of(values: FloatArray) -> Vector:
    """Forward, right and down of an array, shape (3,)."""
    forward, right, down = values.tolist()
    return forward, right, down


@dataclass(frozen=True)
class AlignmentSource:
    """One way in which the flight shows the INS heading error, at the time of the figure.

    ``taxi``: the heading analysis; ``ground run``: the run to lift-off; ``turns``: azimuth by turns in flight, the
    sigma of the mounting included; ``states``: attitude and heading of the best trajectory in place of the INS, where
    there is one. It is None where there is no number. ``at_s``: flight seconds at which it was seen.
    ``reason``: why it is not used.
    """

    name: SourceName
    error_deg: float | None
    sigma_deg: float | None
    at_s: float | None
    is_used: bool
    reason: str = ""
    verdict: str = ""


@dataclass(frozen=True)
class Alignment:
    """INS heading error at the time of the figure.

    The error is taken off the INS heading before anything is compared with it. ``aligned_error_deg`` and
    ``aligned_sigma_deg`` belong to ``aligned_at_s``, ``error_deg`` and ``sigma_deg`` to ``figure_at_s`` (flight
    seconds), after the drift of the hours between. ``origin`` says whence. ``speed_min_mps`` is the speed from which on
    the track may align. ``gyro_*`` are the drifts along forward, right, down at the standstill before flight and their
    sigmas; None where no rates are logged. ``sources`` lists every way in which the flight shows the error. It is the
    airframe's, less the mounting that the aircraft file states.
    """

    origin: str
    error_deg: float
    sigma_deg: float
    aligned_error_deg: float
    aligned_sigma_deg: float
    drift_deg_per_h: float
    drift_sigma_deg_per_h: float
    aligned_at_s: float | None
    figure_at_s: float
    speed_min_mps: float | None = None
    gyro_drift_deg_per_h: Vector | None = None
    gyro_drift_sigma_deg_per_h: Vector | None = None
    sources: tuple[AlignmentSource, ...] = ()

    def source(self, name: SourceName) -> AlignmentSource | None:
        """The source of a name."""
        return next((one for one in self.sources if one.name == name), None)


@dataclass(frozen=True)
class DeclinationUsed:
    """Declination at the figure, east positive, with its sigma and the model's intensities.

    The intensities are horizontal and vertical.
    """

    schema_name: ClassVar[str] = "declination"

    value_deg: float
    sigma_deg: float
    model: str
    horizontal_nt: float | None = None
    down_nt: float | None = None


@dataclass(frozen=True)
class Turn:
    """Turn of about constant bank, and the reason where it is not used.

    Bank is right positive; times are flight seconds.
    """

    start_s: float
    end_s: float
    bank_deg: float
    bank_sd_deg: float
    turned_deg: float
    altitude_m: float | None
    altitude_range_m: float | None
    samples: int
    state: TurnState
    reason: str = ""


@dataclass(frozen=True)
class Swing:
    """One figure: opposite turns that cover the circle together, and its own A to E.

    ``difference_rms_deg`` compares its curve with that of the other figures; None where there is but one.
    """

    number: int
    start_s: float
    end_s: float
    right_bank_deg: float
    left_bank_deg: float
    covered_share: float
    coefficients_deg: dict[str, float] = field(metadata={"keys": LETTERS})
    sigma_deg: dict[str, float] = field(metadata={"keys": LETTERS})
    difference_rms_deg: float | None = None
    difference_sigma_deg: float | None = None


@dataclass(frozen=True)
class SigmaPart:
    """One contribution to the sigma of coefficient A; they add in quadrature."""

    name: str
    sigma_deg: float


@dataclass(frozen=True)
class Coverage:
    """Share of the circle of magnetic headings that both branches cover.

    ``share`` counts bins with readings of both, or in a gap no wider than the settings allow; ``measured_bins`` those
    with readings alone, ``interpolated_bins`` the rest of 360; ``widest_gap_deg`` without readings of both.
    """

    share: float
    measured_bins: int
    interpolated_bins: int
    widest_gap_deg: float


@dataclass(frozen=True)
class Residual:
    """RMS error of the magnetic heading on the part of the flight that no fit has seen.

    The mean of the error is included.
    """

    before: float
    after: float


@dataclass(frozen=True)
class HeldOut:
    """Level part of the flight that no fit has seen.

    ``level_share`` is its share of all that none has seen. ``heading_sectors`` of 30 deg, of 12, were flown in it.
    """

    samples: int
    seconds: float
    heading_sectors: int
    level_share: float
    largest_bank_deg: float


@dataclass(frozen=True)
class Method:
    """One method to find the deviation, fitted or refused, and its error.

    The error is that on the held-out part.

    Parameters
    ----------
    name : {'compass_table', 'poisson_attitude', 'constant_modulus'}
    state : {'fitted', 'refused'}
    reason : str
        Why it is refused, or what it cannot see.
    condition_number : float or None
        Condition number of the scaled normal problem; large: hardly observable.
    fit_rms_nt : float or None
        RMS of what the fit leaves of the field, per axis.
    held_out_before_deg, held_out_after_deg : float or None
        RMS error of the magnetic heading without and with the correction.
    held_out_mean_deg, held_out_mean_sigma_deg : float or None
        Mean of the error after correction, and the sigma it should have. The heading expected comes from the same INS
        and model: of their errors only what the method does not take over counts.
    coefficients_deg, coefficients_sigma_deg : mapping of A ... E to deg
        Coefficients of level flight; empty where refused. The modulus does not show A.
    """

    schema_name: ClassVar[str] = "magnetic_method"

    name: MethodName
    state: MethodState
    reason: str = ""
    samples: int = 0
    parameters: int = 0
    condition_number: float | None = None
    fit_rms_nt: float | None = None
    held_out_before_deg: float | None = None
    held_out_after_deg: float | None = None
    held_out_mean_deg: float | None = None
    held_out_mean_sigma_deg: float | None = None
    coefficients_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})
    coefficients_sigma_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})


@dataclass(frozen=True)
class PoissonParameters:
    """Iron of the aircraft: hard iron, soft iron, effect of a current.

    The parameters make reading = soft_iron @ field + hard_iron + current_effect x (current - reference). ``field`` is
    the earth's along the body axes (forward, right, down). Sigmas have the same shapes; ``current_*`` are None where no
    current was logged, or it did not vary.
    """

    schema_name: ClassVar[str] = "poisson"

    hard_iron_nt: Vector
    hard_iron_sigma_nt: Vector
    soft_iron: Matrix
    soft_iron_sigma: Matrix
    current_effect_nt_per_a: Vector | None = None
    current_effect_sigma_nt_per_a: Vector | None = None
    current_reference_a: float | None = None


@dataclass(frozen=True)
class BankBias:
    """Error that the average of opposite banks has in level flight.

    The error is forecast from the fitted iron.
    """

    bank_deg: float
    rms_deg: float
    is_flown: bool = False


@dataclass(frozen=True)
class OtherCondition:
    """Change of the deviation from the table's under conditions that the figure did not have.

    ``pitch``: for each degree of pitch more than the figure's, by the fitted iron. ``ground``: on the ground, by a
    steady field in the body, ``added_nt``, that a current makes that flows only there or only in the air. ``gain``: at
    the time in the air farthest from the figure, by gains that drift. ``size_deg`` is the RMS over the circle with its
    sigma, ``largest_deg`` the most; None where they are not known. ``told`` says it in words.
    """

    name: ConditionName
    size_deg: float | None
    sigma_deg: float | None
    largest_deg: float | None
    told: str
    added_nt: Vector | None = None


@dataclass(frozen=True)
class CardRow:
    """Row of a steer card: to fly ``magnetic_heading_deg``, steer ``steer_deg``.

    ``steer_deg`` is the uncorrected magnetic heading. ``deviation_deg`` is added to the reading; ``is_interpolated``:
    no reading of both branches near it.
    """

    magnetic_heading_deg: float
    steer_deg: float
    deviation_deg: float
    sigma_deg: float
    is_interpolated: bool


@dataclass(frozen=True)
class MagneticResult(Answer, CompassCoefficients):
    """Deviation of the magnetic heading found in flight. Advisory, not a release to service.

    Parameters
    ----------
    ins_topic, magnetometer_topic : str
    verdict, verdict_reason
        accept: every required gate passed; undecided: nothing failed, a required gate was not measured.
    recommended_method, recommendation
        Method to correct by, and the reason.
    coefficients_deg, coefficients_sigma_deg : mapping of A ... E to deg
        error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading, error = magnetic
        heading - true magnetic heading, declination removed: of the table. The sigma of A holds alignment, drift and
        declination (``a_parts``); that of all the forecast bank bias.
    compass_error_deg : tuple of 360
        Magnetic heading minus true heading in bin [k, k + 1) of magnetic heading: declination is in it.
    deviation_deg : tuple of 360
        To be added to the reading: true magnetic heading minus reading, declination removed.
    other_conditions : tuple of OtherCondition
        Size of what the table does not hold: another pitch, the ground, gains that drift.
    residual_rms_deg : Residual or None
        Before and after the recommended correction, on the held-out part; None where nothing was left to hold out.
    figures
        ``magnetic_samples`` (readings: part of the flight, errors before and after each method), ``magnetic_table``
        (360 bins: branches, average, fitted curve, deviation, bank bias), ``magnetic_curves`` (360 bins: deviation and
        its sigma by each method), ``magnetic_modulus`` (before and after).
    """

    analysis: ClassVar[str] = "magnetic"
    schema_name: ClassVar[str] = analysis

    ins_topic: str
    magnetometer_topic: str
    verdict: MagneticVerdict
    verdict_reason: str
    recommended_method: MethodName
    recommendation: str
    coefficients_deg: dict[str, float] = field(metadata={"keys": LETTERS})
    coefficients_sigma_deg: dict[str, float] = field(metadata={"keys": LETTERS})
    a_parts: tuple[SigmaPart, ...]
    compass_error_deg: tuple[float, ...] = field(metadata={"items": 360})
    deviation_deg: tuple[float, ...] = field(metadata={"items": 360})
    coverage: Coverage
    residual_rms_deg: Residual | None
    alignment: Alignment
    declination: DeclinationUsed
    gates: tuple[Gate, ...]
    methods: tuple[Method, ...]
    turns: tuple[Turn, ...]
    swings: tuple[Swing, ...]
    bank_bias: tuple[BankBias, ...]
    card: tuple[CardRow, ...]
    held_out: HeldOut | None = None
    poisson: PoissonParameters | None = None
    modulus: PoissonParameters | None = None
    table_fit_rms_deg: float | None = None
    attitude_wander_deg: float | None = None
    other_conditions: tuple[OtherCondition, ...] = ()
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def method(self, name: MethodName) -> Method:
        """Return the row of a method; refused where it was never tried."""
        found = (row for row in self.methods if row.name == name)
        return next(found, Method(name, "refused", "not tried"))
