"""Deviation of a compass that gives heading alone, from straight legs and turns in flight."""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

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

    name: ReferenceName
    topic: str
    is_used: bool
    sigma_deg: float | None
    reason: str = ""


@dataclass(frozen=True)
class WindSolved:
    """Wind that the flight shows by ground velocity and true airspeed, without the compass.

    ``changes_mps`` is the standard deviation of its slow changes, a component; ``airspeed_scale`` true over logged.
    """

    north_mps: float
    east_mps: float
    changes_mps: float
    airspeed_scale: float
    airspeed_scale_sigma: float


@dataclass(frozen=True)
class FluxLeg:
    """Straight leg in flight, and the reason where it is not used. Times: flight seconds.

    ``error_deg`` is magnetic heading as read + declination - true heading of the reference. ``noise_sigma_deg`` is that
    of the reading, ``sigma_deg`` of the whole error with the reference and the declination.
    """

    start_s: float
    end_s: float
    magnetic_heading_deg: float
    true_heading_deg: float | None
    error_deg: float | None
    noise_sigma_deg: float | None
    sigma_deg: float | None
    speed_mps: float
    altitude_m: float | None
    samples: int
    state: LegState
    reason: str = ""


@dataclass(frozen=True)
class FluxMethod:
    """One way to find the coefficients, given or refused with the reason."""

    name: FluxMethodName
    state: Literal["fitted", "refused"]
    reason: str = ""
    samples: int = 0
    coefficients_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})
    coefficients_sigma_deg: dict[str, float] = field(default_factory=dict, metadata={"keys": LETTERS})


@dataclass(frozen=True)
class BankError:
    """Error that bank and slaving make, as the turns show it.

    ``lean`` is the share of the bank by which the sensing element leans: 1 hangs along the apparent vertical, 0 is kept
    level. ``lag_s`` is the time over which the reading follows the element: of a slaved gyro, minutes. Pairs are 95 %
    intervals. ``bank_max_deg`` and ``after_turn_s`` bound the use: beyond them the heading is off by more than the
    limit of the settings. ``worst_deg`` is the largest error by bank in the flight.
    """

    state: Literal["found", "not observable"]
    reason: str
    turns: int
    lean: float | None = None
    lean95: tuple[float, float] | None = None
    lag_s: float | None = None
    lag95_s: tuple[float, float] | None = None
    rate_lag_s: float | None = None
    worst_deg: float | None = None
    bank_max_deg: float | None = None
    after_turn_s: float | None = None


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
    verdict: MagneticVerdict
    verdict_reason: str
    recommended_method: FluxMethodName
    references: tuple[FluxReference, ...]
    declination: DeclinationUsed
    legs: tuple[FluxLeg, ...]
    methods: tuple[FluxMethod, ...]
    coefficients: tuple[GroundCoefficient, ...]
    a_parts: tuple[SigmaPart, ...]
    bank_error: BankError
    directions: int
    widest_gap_deg: float
    settle_s: float
    place_sigma_deg: float
    gates: tuple[Gate, ...]
    card: tuple[CardRow, ...]
    deviation_deg: tuple[float, ...] = field(metadata={"items": 360})
    wind: WindSolved | None = None
    along: AlongAxis | None = None
    residual_rms_deg: Residual | None = None
    dip_deg: float | None = None
    logged_variation_deg: float | None = None
    heading_step_deg: float | None = None
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
