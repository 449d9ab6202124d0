"""Answer of the magnetic estimator: deviation found in flight, with its sigma.

The answer also tells what the correction leaves over.
"""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
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

    name: SourceName  #: Way in which the flight shows it.
    error_deg: float | None  #: INS heading minus true heading at the time of the figure; null without a number.
    sigma_deg: float | None  #: Standard deviation of the error.
    at_s: float | None  #: Flight second at which it was seen.
    is_used: bool  #: Whether the alignment rests on it.
    reason: str = ""  #: Why it is not used; empty where it is.
    verdict: str = ""  #: Verdict of the analysis it comes from; empty without one.


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

    origin: str  #: What the alignment rests on.
    error_deg: float  #: INS heading minus true heading at figure_at_s.
    sigma_deg: float  #: Standard deviation of error_deg.
    aligned_error_deg: float  #: INS heading minus true heading at aligned_at_s.
    aligned_sigma_deg: float  #: Standard deviation of aligned_error_deg.
    drift_deg_per_h: float  #: Growth of the error between both.
    drift_sigma_deg_per_h: float  #: Standard deviation of the growth.
    aligned_at_s: float | None  #: Flight second at which the error was found.
    figure_at_s: float  #: Flight second of the figure that the deviation is of.
    speed_min_mps: float | None = None  #: Speed from which on the track may align.
    #: Gyro drifts along forward, right, down at rest before flight; null without rates.
    gyro_drift_deg_per_h: Vector | None = None
    gyro_drift_sigma_deg_per_h: Vector | None = None  #: Their standard deviations.
    sources: tuple[AlignmentSource, ...] = ()  #: Every way in which the flight shows the error.

    def source(self, name: SourceName) -> AlignmentSource | None:
        """The source of a name."""
        return next((one for one in self.sources if one.name == name), None)


@dataclass(frozen=True)
class DeclinationUsed:
    """Declination at the figure, east positive, with its sigma and the model's intensities.

    The intensities are horizontal and vertical.
    """

    schema_name: ClassVar[str] = "declination"

    value_deg: float  #: Declination, east positive.
    sigma_deg: float  #: Standard deviation of the declination.
    model: str  #: Magnetic model and date, or the log.
    horizontal_nt: float | None = None  #: Horizontal intensity by the model.
    down_nt: float | None = None  #: Vertical intensity by the model, down positive.


@dataclass(frozen=True)
class Turn:
    """Turn of about constant bank, and the reason where it is not used.

    Bank is right positive; times are flight seconds.
    """

    start_s: float
    end_s: float
    bank_deg: float  #: Mean bank, right positive.
    bank_sd_deg: float  #: Scatter of the bank.
    turned_deg: float  #: Heading that was turned through.
    altitude_m: float | None  #: Mean altitude; null without one.
    altitude_range_m: float | None  #: Highest less lowest altitude.
    samples: int  #: Readings in it.
    state: TurnState  #: used or rejected.
    reason: str = ""  #: Why it is rejected; empty where it is used.


@dataclass(frozen=True)
class Swing:
    """One figure: opposite turns that cover the circle together, and its own A to E.

    ``difference_rms_deg`` compares its curve with that of the other figures; None where there is but one.
    """

    number: int  #: From 1, in order of time.
    start_s: float
    end_s: float
    right_bank_deg: float  #: Mean bank of the right turns.
    left_bank_deg: float  #: Mean bank of the left turns.
    covered_share: float  #: Share of the circle that it covers.
    coefficients_deg: dict[str, float] = field(metadata={"keys": LETTERS})  #: A to E by this figure alone.
    sigma_deg: dict[str, float] = field(metadata={"keys": LETTERS})  #: Standard deviation of its curve.
    #: RMS over the circle of its curve minus that of the others; null where there is but one.
    difference_rms_deg: float | None = None
    difference_sigma_deg: float | None = None  #: What their sigmas expect of that difference.


@dataclass(frozen=True)
class SigmaPart:
    """One contribution to the sigma of coefficient A; they add in quadrature."""

    name: str  #: Where it comes from.
    sigma_deg: float  #: Its standard deviation; they add in quadrature.


@dataclass(frozen=True)
class Coverage:
    """Share of the circle of magnetic headings that both branches cover.

    ``share`` counts bins with readings of both, or in a gap no wider than the settings allow; ``measured_bins`` those
    with readings alone, ``interpolated_bins`` the rest of 360; ``widest_gap_deg`` without readings of both.
    """

    share: float  #: Share of the circle that both branches cover, small gaps included.
    measured_bins: int  #: Bins of a degree with readings of both branches.
    interpolated_bins: int  #: Other bins of the 360.
    widest_gap_deg: float  #: Widest part of the circle without readings of both.


@dataclass(frozen=True)
class Residual:
    """RMS error of the magnetic heading on the part of the flight that no fit has seen.

    The mean of the error is included.
    """

    before: float  #: RMS error of the heading without correction, degrees.
    after: float  #: RMS error of the heading with the correction, degrees.


@dataclass(frozen=True)
class HeldOut:
    """Level part of the flight that no fit has seen.

    ``level_share`` is its share of all that none has seen. ``heading_sectors`` of 30 deg, of 12, were flown in it.
    """

    samples: int  #: Readings in it.
    seconds: float  #: Length of it.
    heading_sectors: int  #: Sectors of 30 deg, of 12, that it covers.
    level_share: float  #: Its share of all that no fit has seen.
    largest_bank_deg: float  #: Greatest bank in it.


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

    name: MethodName  #: Stable name for scripts.
    state: MethodState  #: fitted, or refused with the reason.
    reason: str = ""
    samples: int = 0  #: Readings it was fitted to.
    parameters: int = 0  #: Number of parameters fitted.
    condition_number: float | None = None
    fit_rms_nt: float | None = None
    #: RMS error of the heading without correction, where the fit has not seen.
    held_out_before_deg: float | None = None
    #: RMS error of the heading with the correction, where the fit has not seen.
    held_out_after_deg: float | None = None
    held_out_mean_deg: float | None = None  #: Mean of the error after correction.
    held_out_mean_sigma_deg: float | None = None  #: Sigma that this mean should have.
    #: A to E of level flight; empty where refused.
    coefficients_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})
    #: Standard deviations of A to E.
    coefficients_sigma_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})


@dataclass(frozen=True)
class PoissonParameters:
    """Iron of the aircraft: hard iron, soft iron, effect of a current.

    The parameters make reading = soft_iron @ field + hard_iron + current_effect x (current - reference). ``field`` is
    the earth's along the body axes (forward, right, down). Sigmas have the same shapes; ``current_*`` are None where no
    current was logged, or it did not vary.
    """

    schema_name: ClassVar[str] = "poisson"

    hard_iron_nt: Vector  #: Steady field of the aircraft along forward, right, down.
    hard_iron_sigma_nt: Vector  #: Standard deviations of the hard iron.
    soft_iron: Matrix  #: Matrix from the earth's field to the reading, body axes.
    soft_iron_sigma: Matrix  #: Standard deviations of the matrix.
    #: Field that an ampere makes along forward, right, down; null without a current.
    current_effect_nt_per_a: Vector | None = None
    current_effect_sigma_nt_per_a: Vector | None = None  #: Standard deviations of the current's effect.
    current_reference_a: float | None = None  #: Current at which the hard iron holds.


@dataclass(frozen=True)
class BankBias:
    """Error that the average of opposite banks has in level flight.

    The error is forecast from the fitted iron.
    """

    bank_deg: float  #: Bank of both turns.
    rms_deg: float  #: RMS error over the circle.
    is_flown: bool = False  #: Whether the flight has turns of this bank.


@dataclass(frozen=True)
class OtherCondition:
    """Change of the deviation from the table's under conditions that the figure did not have.

    ``pitch``: for each degree of pitch more than the figure's, by the fitted iron. ``ground``: on the ground, by a
    steady field in the body, ``added_nt``, that a current makes that flows only there or only in the air. ``gain``: at
    the time in the air farthest from the figure, by gains that drift. ``size_deg`` is the RMS over the circle with its
    sigma, ``largest_deg`` the most; None where they are not known. ``told`` says it in words.
    """

    name: ConditionName  #: pitch, for each degree more; ground; or gain, by sensors that drift.
    size_deg: float | None  #: RMS change of the deviation over the circle; null where not known.
    sigma_deg: float | None  #: Standard deviation of the size.
    largest_deg: float | None  #: Greatest change over the circle.
    told: str  #: The same in words.
    added_nt: Vector | None = None  #: Field that is only there, along forward, right, down.


@dataclass(frozen=True)
class CardRow:
    """Row of a steer card: to fly ``magnetic_heading_deg``, steer ``steer_deg``.

    ``steer_deg`` is the uncorrected magnetic heading. ``deviation_deg`` is added to the reading; ``is_interpolated``:
    no reading of both branches near it.
    """

    magnetic_heading_deg: float  #: Heading to fly.
    steer_deg: float  #: Reading to hold, not corrected.
    deviation_deg: float  #: To be added to the reading.
    sigma_deg: float  #: Standard deviation of the deviation.
    is_interpolated: bool  #: No reading of both branches near it.


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

    ins_topic: str  #: Topic of the INS whose attitude is used.
    magnetometer_topic: str  #: Topic of the magnetometer, or of the magnetic heading.
    #: accept: every required gate passed; reject: one failed; undecided: one was not measured.
    verdict: MagneticVerdict
    verdict_reason: str  #: Gate that decided it, for people.
    recommended_method: MethodName  #: Method to correct by.
    recommendation: str  #: Why that method.
    #: A to E of error = A + B sin c + C cos c + D sin 2c + E cos 2c, c the magnetic heading as read.
    coefficients_deg: dict[str, float] = field(metadata={"keys": LETTERS})
    coefficients_sigma_deg: dict[str, float] = field(metadata={"keys": LETTERS})  #: Standard deviations of A to E.
    a_parts: tuple[SigmaPart, ...]  #: What the sigma of A is made of.
    compass_error_deg: tuple[float, ...] = field(metadata={"items": 360})
    deviation_deg: tuple[float, ...] = field(metadata={"items": 360})
    coverage: Coverage  #: Part of the circle of headings that was flown.
    residual_rms_deg: Residual | None
    alignment: Alignment  #: INS heading error that was taken off before.
    declination: DeclinationUsed  #: Declination used.
    gates: tuple[Gate, ...]  #: Conditions of the verdict, each with figure and limit.
    methods: tuple[Method, ...]  #: Every method tried, with its error on what it has not seen.
    turns: tuple[Turn, ...]  #: Turns of the flight, used or not.
    swings: tuple[Swing, ...]  #: Every figure of opposite turns by itself.
    bank_bias: tuple[BankBias, ...]  #: What the average of opposite banks leaves in level flight.
    card: tuple[CardRow, ...]  #: Steer card: reading to hold for each magnetic heading.
    held_out: HeldOut | None = None  #: Level part of the flight that no fit has seen; null where nothing was left.
    poisson: PoissonParameters | None = None  #: Iron of the aircraft; null where it was not fitted.
    modulus: PoissonParameters | None = None  #: Iron by the size of the field alone; null where it was not fitted.
    table_fit_rms_deg: float | None = None  #: RMS of the 360 bins about the curve A to E.
    attitude_wander_deg: float | None = None  #: What roll and pitch of the INS are wrong by in the mean of the figure.
    other_conditions: tuple[OtherCondition, ...] = ()
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def method(self, name: MethodName) -> Method:
        """Return the row of a method; refused where it was never tried."""
        found = (row for row in self.methods if row.name == name)
        return next(found, Method(name, "refused", "not tried"))
