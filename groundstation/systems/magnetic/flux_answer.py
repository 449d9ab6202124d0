"""Deviation of a compass that gives heading alone, from straight legs and turns in flight."""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.gates import Gate
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import CardRow, DeclinationUsed, MagneticVerdict, Residual, SigmaPart
from groundstation.systems.magnetic.ground_answer import AlongAxis, GroundCoefficient

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

FluxMethodName = Literal["straight_legs", "opposite_turns"]
ReferenceName = Literal["states", "ins", "wind"]
LegState = Literal["used", "rejected"]
FLUX_TITLES: dict[FluxMethodName, str] = {"straight_legs": "straight legs", "opposite_turns": "opposite turns"}
REFERENCE_TITLES: dict[ReferenceName, str] = {
    "states": "best trajectory",
    "ins": "INS true heading",
    "wind": "GNSS velocity with the wind solved",
}


@dataclass(frozen=True)
class FluxReference:
    """Reference of the true heading, used or not, and the reason.

    ``sigma_deg`` is what is common to the whole flight: it goes into A one to one.
    """

    name: ReferenceName  #: states (best trajectory), ins or wind triangle.
    topic: str  #: Topic it comes from.
    is_used: bool  #: Whether the legs are judged by it.
    sigma_deg: float | None  #: Sigma common to the whole flight: it goes into A one to one.
    reason: str = ""  #: Why it is not used, or what it rests on.


@dataclass(frozen=True)
class WindSolved:
    """Wind that the flight shows by ground velocity and true airspeed, without the compass.

    ``changes_mps`` is the standard deviation of its slow changes, a component; ``airspeed_scale`` true over logged.
    """

    north_mps: float  #: Velocity of the air towards north.
    east_mps: float  #: Velocity of the air towards east.
    changes_mps: float  #: Standard deviation of its slow changes, a component.
    airspeed_scale: float  #: True over logged airspeed.
    airspeed_scale_sigma: float  #: Standard deviation of that scale.


@dataclass(frozen=True)
class FluxLeg:
    """Straight leg in flight, and the reason where it is not used. Times: flight seconds.

    ``error_deg`` is magnetic heading as read + declination - true heading of the reference. ``noise_sigma_deg`` is that
    of the reading, ``sigma_deg`` of the whole error with the reference and the declination.
    """

    start_s: float
    end_s: float
    magnetic_heading_deg: float  #: Mean magnetic heading as read.
    true_heading_deg: float | None  #: Mean true heading of the reference.
    error_deg: float | None  #: Magnetic heading + declination - true heading.
    noise_sigma_deg: float | None  #: Standard deviation of the reading.
    sigma_deg: float | None  #: Standard deviation of the whole error, reference and declination in it.
    speed_mps: float  #: Mean ground speed.
    altitude_m: float | None  #: Mean altitude; null without one.
    samples: int  #: Readings in it.
    state: LegState  #: used or rejected.
    reason: str = ""  #: Why it is rejected; empty where it is used.


@dataclass(frozen=True)
class FluxMethod:
    """One way to find the coefficients, given or refused with the reason."""

    name: FluxMethodName  #: Stable name for scripts.
    state: Literal["fitted", "refused"]  #: fitted, or refused with the reason.
    reason: str = ""  #: Why it is refused; empty where it is fitted.
    samples: int = 0  #: Readings it was fitted to.
    #: A to E of level flight; empty where refused.
    coefficients_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})
    #: Standard deviations of A to E.
    coefficients_sigma_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})


@dataclass(frozen=True)
class BankError:
    """Error that bank and slaving make, as the turns show it.

    ``lean`` is the share of the bank by which the sensing element leans: 1 hangs along the apparent vertical, 0 is kept
    level. ``lag_s`` is the time over which the reading follows the element: of a slaved gyro, minutes. Pairs are 95 %
    intervals. ``bank_max_deg`` and ``after_turn_s`` bound the use: beyond them the heading is off by more than the
    limit of the settings. ``worst_deg`` is the largest error by bank in the flight.
    """

    state: Literal["found", "not observable"]  #: found or not observable.
    reason: str  #: Why it is not observable; empty where it is found.
    turns: int  #: Turns it rests on.
    lean: float | None = None  #: Share of the bank by which the sensing element leans: 1 hangs free, 0 is kept level.
    lean95: tuple[float, float] | None = None  #: 95 % interval of the lean [low, high].
    lag_s: float | None = None  #: Time over which the reading follows the element.
    lag95_s: tuple[float, float] | None = None  #: 95 % interval of the lag [low, high].
    rate_lag_s: float | None = None  #: Lag of the reading by turn rate.
    worst_deg: float | None = None  #: Largest error by bank in the flight.
    bank_max_deg: float | None = None  #: Bank beyond which the heading is off by more than the limit.
    after_turn_s: float | None = None  #: Seconds after a turn until the heading is good again.


@dataclass(frozen=True)
class FluxDeviation(Answer):
    """Deviation of a compass that gives heading alone. Advisory, not a release to service.

    Parameters
    ----------
    ins_topic : str
        Topic of the magnetic heading.
    verdict, verdict_reason
        accept: every required gate passed; undecided: nothing failed, a required gate was not measured.
    references : tuple of FluxReference
        What the true heading could come from, the used one first.
    coefficients : tuple of GroundCoefficient
        error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the magnetic heading as read, declination removed: as
        far as the headings flown show them, by the recommended method.
    deviation_deg : tuple of 360
        To be added to the reading in the middle of each degree.
    residual_rms_deg : Residual or None
        RMS error of legs before, and after correction by the fit to the legs of the other directions.
    figures
        ``magnetic_flux_epochs``, ``magnetic_flux_curve``, ``magnetic_flux_turns``.
    """

    analysis: ClassVar[str] = "magnetic_flux"
    schema_name: ClassVar[str] = analysis

    ins_topic: str
    #: accept: every required gate passed; reject: one failed; undecided: one was not measured.
    verdict: MagneticVerdict
    verdict_reason: str  #: Gate that decided it, for people.
    recommended_method: FluxMethodName  #: Method to correct by.
    references: tuple[FluxReference, ...]
    declination: DeclinationUsed  #: Declination used.
    legs: tuple[FluxLeg, ...]  #: Straight legs, used or not.
    methods: tuple[FluxMethod, ...]  #: Every method tried.
    coefficients: tuple[GroundCoefficient, ...]
    a_parts: tuple[SigmaPart, ...]  #: What the sigma of A is made of.
    bank_error: BankError  #: Error by bank and slaving.
    directions: int  #: Directions that the used legs have.
    widest_gap_deg: float  #: Widest part of the circle without a leg.
    settle_s: float  #: Seconds after a turn that are left out until the compass has settled.
    place_sigma_deg: float  #: What each leg has of its own beyond noise, one sigma.
    gates: tuple[Gate, ...]  #: Conditions of the verdict, each with figure and limit.
    card: tuple[CardRow, ...]  #: Steer card: reading to hold for each magnetic heading.
    deviation_deg: tuple[float, ...] = field(metadata={"items": 360})
    wind: WindSolved | None = None  #: Wind that the flight shows; null without airspeed.
    along: AlongAxis | None = None  #: What is seen along an axis where B or C alone is not.
    residual_rms_deg: Residual | None = None
    dip_deg: float | None = None  #: Dip of the field by the model.
    logged_variation_deg: float | None = None  #: Mean of what the device takes for declination; null where not logged.
    heading_step_deg: float | None = None  #: Step in which the log writes the heading; null where none shows.
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def used(self) -> tuple[FluxLeg, ...]:
        """The legs that count."""
        return tuple(leg for leg in self.legs if leg.state == "used")

    @property
    def reference(self) -> FluxReference:
        """The reference that is used."""
        return next(one for one in self.references if one.is_used)

    def coefficient(self, letter: str) -> GroundCoefficient:
        """One of A to E."""
        return next(item for item in self.coefficients if item.letter == letter)

    def method(self, name: FluxMethodName) -> FluxMethod:
        """The row of a method."""
        return next(row for row in self.methods if row.name == name)
