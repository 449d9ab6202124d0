"""Settings of a flight with several INS units: what they share, how they write, faults."""

from dataclasses import field
from typing import ClassVar, Literal, TypeAlias

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number, required_number
from groundstation.simulation.inertial_family import ORDINARY_RECEIVER, GnssErrorModel
from groundstation.simulation.ins_class import InsClass, load_ins_class
from groundstation.simulation.routes import RouteKind

MOST_UNITS = 9


@dataclass(frozen=True)
class UnitFault:
    """Fault of one unit; units are numbered from 1."""

    unit: int = required_number(1, MOST_UNITS)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class UnitDrift(UnitFault):
    """Constant added to the level gyros, in class constants, at an angle from the body's nose.

    It begins behind the alignment, which therefore does not absorb it.
    """

    kind: ClassVar[str] = "drift"
    times: float = number(4.0, 0.0, 1e4)
    direction_deg: float = number(90.0, -360.0, 360.0)
    at_s: float = number(0.0, 0.0)


@dataclass(frozen=True)
class UnitTilt(UnitFault):
    """Tilt added at the start, in class tilts; its direction is that of the velocity error."""

    kind: ClassVar[str] = "tilt"
    times: float = number(4.0, 0.0, 1e4)
    direction_deg: float = number(0.0, -360.0, 360.0)


@dataclass(frozen=True)
class UnitStep(UnitFault):
    """Step of position or velocity; the oscillation that follows is computed."""

    kind: ClassVar[str] = "step"
    at_s: float = required_number(0.0)
    north_m: float = number(0.0, -1e6, 1e6)
    east_m: float = number(0.0, -1e6, 1e6)
    north_mps: float = number(0.0, -1e3, 1e3)
    east_mps: float = number(0.0, -1e3, 1e3)


@dataclass(frozen=True)
class UnitReset(UnitFault):
    """Setting of position and velocity to the truth; tilts stay as they are."""

    kind: ClassVar[str] = "reset"
    at_s: float = required_number(0.0)


@dataclass(frozen=True)
class UnitSwapped(UnitFault):
    """Velocity north logged as east and east as north, from a time on."""

    kind: ClassVar[str] = "swapped"
    at_s: float = number(0.0, 0.0)


@dataclass(frozen=True)
class UnitStuck(UnitFault):
    """Velocity that keeps one value while the position goes on."""

    kind: ClassVar[str] = "stuck"
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)
    axis: Literal["north", "east", "both"] = "both"


@dataclass(frozen=True)
class UnitFrozen(UnitFault):
    """Outputs that all keep one value."""

    kind: ClassVar[str] = "frozen"
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class UnitHeading(UnitFault):
    """Constant added to the heading that a unit writes, as of one aligned or mounted askew."""

    kind: ClassVar[str] = "heading"
    offset_deg: float = number(1.0, -180.0, 180.0)


@dataclass(frozen=True)
class UnitClock(UnitFault):
    """Stamps of a unit that are late, and run fast or slow."""

    kind: ClassVar[str] = "clock"
    late_s: float = number(0.0, -3600.0, 3600.0)
    rate_ppm: float = number(0.0, -1e4, 1e4)


@dataclass(frozen=True)
class UnitWithoutPosition(UnitFault):
    """Unit that logs velocity and attitude alone."""

    kind: ClassVar[str] = "no_position"


@dataclass(frozen=True)
class UnitAided(UnitFault):
    """Unit that GNSS corrects; without GNSS it coasts with ``share`` of the class errors."""

    kind: ClassVar[str] = "aided"
    position_m: float = number(2.0, 0.0, 1e3)
    velocity_mps: float = number(0.03, 0.0, 10.0)
    share: float = number(0.2, 0.0, 1.0)
    is_stated: bool = False


@dataclass(frozen=True)
class UnitTwin(UnitFault):
    """Unit that is logged a second time, in place of this one."""

    kind: ClassVar[str] = "twin"
    of: int = number(1, 1, MOST_UNITS)


@dataclass(frozen=True)
class UnitExchanged(UnitFault):
    """Other unit switched to the topic at a time: serial and errors change."""

    kind: ClassVar[str] = "exchanged"
    at_s: float = required_number(0.0)


AnyUnitFault: TypeAlias = (
    UnitDrift
    | UnitTilt
    | UnitStep
    | UnitReset
    | UnitSwapped
    | UnitStuck
    | UnitFrozen
    | UnitHeading
    | UnitClock
    | UnitWithoutPosition
    | UnitAided
    | UnitTwin
    | UnitExchanged
)


@dataclass(frozen=True)
class UnitOutput:
    """Noise and rounding of what a unit writes; a step of zero rounds nothing."""

    velocity_noise_mps: float = number(0.005, 0.0, 5.0)
    heading_noise_deg: float = number(0.005, 0.0, 5.0)
    velocity_step_mps: float = number(0.001, 0.0, 1.0)
    position_step_deg: float = number(1e-7, 0.0, 0.01)
    heading_step_deg: float = number(0.001, 0.0, 1.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class CommonErrors:
    """Errors that all units share beside gravity and the position typed in.

    ``tilt_times`` class tilts at a random direction and ``azimuth_deg`` at the start; ``heavy_tail_freedom``: constants
    of gyros and accelerometers are of Student's t with so many degrees of freedom, 0 for the normal distribution.
    ``deflection_arcsec`` over ``deflection_km``: deflection of the vertical in place of the class's.
    """

    tilt_times: float = number(0.0, 0.0, 1e3)
    azimuth_deg: float = number(0.0, -10.0, 10.0)
    heavy_tail_freedom: int = number(0, 0, 100)
    deflection_arcsec: float | None = number(None, 0.0, 60.0)
    deflection_km: float = number(40.0, 0.1, 1e4)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class GnssOutage:
    """Interval without GNSS, seconds of the flight, its end not included."""

    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class UnitsSettings:
    """Everything that determines a flight with several units, but for its seed.

    Parameters
    ----------
    units : int
    ins : str or InsClass
        Class of the units.
    ins_of_others : str
        Class of all units but the first where it is another one; the log states it of each.
    each_its_own : bool
        Each unit is an instrument of its own (:func:`groundstation.simulation.ins_class.draw_instrument`).
    gnss : GnssErrorModel
    has_gnss : bool
        False: no receiver in the log.
    outages : tuple of GnssOutage
    gust_mps : float
        Sigma of the velocity over the ground about the route, in the air.
    states_start : bool
        The log says when navigation began: at its first second.
    faults : tuple
        In the order given; those of outputs follow those of errors.
    """

    units: int = number(2, 1, MOST_UNITS)
    ins: str | InsClass = "navigation"
    ins_of_others: str = ""
    route: RouteKind = "straight"
    duration_s: float = number(7200.0, 600.0, 50_000.0)
    step_s: float = number(1.0, 0.1, 10.0)
    each_its_own: bool = False
    gnss: GnssErrorModel = ORDINARY_RECEIVER
    has_gnss: bool = True
    outages: tuple[GnssOutage, ...] = ()
    gust_mps: float = number(0.3, 0.0, 10.0)
    output: UnitOutput = field(default_factory=UnitOutput)
    common: CommonErrors = field(default_factory=CommonErrors)
    states_start: bool = True
    faults: tuple[AnyUnitFault, ...] = ()

    def __post_init__(self) -> None:
        check_ranges(self)
        for place, fault in enumerate(self.faults):
            if fault.unit > self.units:
                raise SettingsError(f"faults[{place}].unit", str(fault.unit), f"1 to {self.units}")
            if isinstance(fault, UnitTwin) and (fault.of > self.units or fault.of == fault.unit):
                raise SettingsError(f"faults[{place}].of", str(fault.of), f"another unit, 1 to {self.units}")
            begin_s = getattr(fault, "at_s", getattr(fault, "from_s", 0.0))
            if begin_s > self.duration_s - 2.0 * self.step_s:
                raise SettingsError(f"faults[{place}]", f"{begin_s:g} s", f"before the end at {self.duration_s:g} s")
        for name, spans in (
            ("outages", self.outages),
            ("faults", [one for one in self.faults if isinstance(one, UnitStuck | UnitFrozen)]),
        ):
            for span in spans:
                if span.to_s <= span.from_s:
                    raise SettingsError(name, f"end {span.to_s:g} s", f"an end after the start {span.from_s:g} s")

    @property
    def ins_class(self) -> InsClass:
        """The class itself."""
        return load_ins_class(self.ins) if isinstance(self.ins, str) else self.ins

    def class_of(self, unit: int) -> InsClass:
        """Return the class of a unit."""
        return load_ins_class(self.ins_of_others) if self.ins_of_others and unit > 1 else self.ins_class
