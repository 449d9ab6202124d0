"""Answer on the INS on the ground: alignment, stand, shutdown, alignments between."""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.systems.inertial.units_answer import Measured

AlignmentKind = Literal["gyrocompass", "stored_heading", "in_motion", "gnss_aided", "unknown"]
AlignmentBasis = Literal["stated", "mode", "still_output", "standstill", "none"]
GroundPlace = Literal["standing", "moving", "unknown"]
ALIGNMENT_KINDS: tuple[str, ...] = ("gyrocompass", "stored_heading", "in_motion", "gnss_aided", "unknown")
ALIGNMENT_BASES: tuple[str, ...] = ("stated", "mode", "still_output", "standstill", "none")
GROUND_PLACES: tuple[str, ...] = ("standing", "moving", "unknown")


@dataclass(frozen=True)
class InsAlignment:
    """Alignment before navigation, as far as the log shows it.

    Parameters
    ----------
    kind : str
    basis : str
        ``mode``: the logged mode; ``still_output``: velocities of exactly zero that then began to move;
        ``standstill``: the log begins parked; ``stated``: the start of navigation is stated; ``none``: nothing shows
        it.
    reason : str
        What tells the kind, in words.
    start_s, end_s, length_s : float or None
        Flight seconds; ``length_s`` is a lower bound where ``is_cut``.
    is_cut : bool
        The log begins within the alignment.
    is_moved : bool or None
        Whether the aircraft moved during it; None where nothing shows it.
    moved_m, moved_at_s : float or None
        Largest distance from its place at the beginning, and when it first moved.
    """

    schema_name: ClassVar[str] = "alignment_before_navigation"

    #: gyrocompass, stored_heading, in_motion, gnss_aided or unknown.
    kind: AlignmentKind = field(metadata={"one_of": ALIGNMENT_KINDS})
    basis: AlignmentBasis = field(metadata={"one_of": ALIGNMENT_BASES})
    reason: str
    start_s: float | None = None  #: Flight second of its beginning, as far as the log shows it.
    end_s: float | None = None  #: Flight second of its end.
    length_s: float | None = None  #: From beginning to end; a lower bound where is_cut.
    is_cut: bool = False
    is_moved: bool | None = None
    moved_m: float | None = None  #: Largest distance from its place at the beginning.
    moved_at_s: float | None = None  #: Flight second at which it first moved.


@dataclass(frozen=True)
class ErrorsAtStart:
    """Tilt and azimuth error at the start of navigation, from the data after it.

    The tilts are those of the smoother of the coupled model, positive where the velocity error falls; the azimuth is
    that of the turns carried back. None where ``tilt_reason`` or ``azimuth_reason`` says why.
    """

    schema_name: ClassVar[str] = "errors_at_start"

    #: Tilt of the north channel at the start, positive where its velocity error falls.
    tilt_north_arcsec: Measured | None
    #: Tilt of the east channel at the start, positive where its velocity error falls.
    tilt_east_arcsec: Measured | None
    azimuth_deg: Measured | None  #: Azimuth error at the start.
    tilt_reason: str  #: Why there is no tilt; empty where there is one.
    azimuth_reason: str  #: Why there is no azimuth error; empty where there is one.


@dataclass(frozen=True)
class StandingDrift:
    """Drift of the ground speed of the INS while the aircraft stands after the alignment.

    Parameters
    ----------
    start_s, end_s : float
    north_mps_per_min, east_mps_per_min : Measured
        Slopes of the velocity.
    size_mps_per_min : Measured
        Length of both; its interval reaches down to zero at most.
    limit_mps_per_min : float or None
        Length that an honest unit of the class does not exceed in 99.7 % of stands; None where it is not judged.
    is_above : bool
        The whole interval lies above the limit.
    """

    schema_name: ClassVar[str] = "standing_drift"

    start_s: float
    end_s: float
    north_mps_per_min: Measured  #: Slope of the velocity north.
    east_mps_per_min: Measured  #: Slope of the velocity east.
    size_mps_per_min: Measured
    limit_mps_per_min: float | None = None
    is_above: bool = False


@dataclass(frozen=True)
class InsShutdown:
    """State of the INS at the end of the log.

    Parameters
    ----------
    is_parked : bool
        The log ends while the aircraft stands, after it had moved.
    reason : str
        What is missing, in words; empty where nothing is.
    start_s, end_s : float or None
        The stand at the end.
    residual_speed_mps : Measured or None
        Ground speed that the INS shows while parked.
    position_error_m : Measured or None
        Distance from GNSS, the mean of the last minute with both.
    position_at_s : float or None
        End of that minute.
    hours : float or None
        From the start of navigation, or the last reset, to ``position_at_s``.
    terminal_rate_nmiph : Measured or None
        Position error over the hours.
    """

    schema_name: ClassVar[str] = "ins_shutdown"

    is_parked: bool
    reason: str
    start_s: float | None = None  #: Flight second at which the stand at the end begins.
    end_s: float | None = None  #: Flight second at which it ends.
    residual_speed_mps: Measured | None = None
    position_error_m: Measured | None = None
    position_at_s: float | None = None  #: Flight second at the end of that minute.
    hours: float | None = None
    terminal_rate_nmiph: Measured | None = None


@dataclass(frozen=True)
class InsRealignment:
    """Change of the errors of the INS by an alignment, or a position set, after the start.

    Parameters
    ----------
    start_s, end_s : float
        Flight seconds between which the INS did not navigate; equal where its position was set.
    is_aligned : bool
        The logged mode went back to alignment; else the position alone was set.
    place : str
    position_step_m, velocity_step_mps, heading_step_deg : Measured or None
        After less before; of position and velocity the length.
    rate_before_nmiph, rate_after_nmiph : float or None
        Slope through the origin of the position error, since the start of navigation or the reset before, and since
        this one.
    """

    schema_name: ClassVar[str] = "ins_realignment"

    start_s: float  #: Flight second from which the INS did not navigate; end_s where its position was set.
    end_s: float  #: Flight second from which it navigated again.
    is_aligned: bool
    #: standing, moving or unknown: what the aircraft did.
    place: GroundPlace = field(metadata={"one_of": GROUND_PLACES})
    position_step_m: Measured | None = None  #: Length of the position error after less before.
    velocity_step_mps: Measured | None = None  #: Length of the velocity error after less before.
    heading_step_deg: Measured | None = None  #: Heading after less before.
    rate_before_nmiph: float | None = None  #: Slope of the position error since the start or the reset before.
    rate_after_nmiph: float | None = None  #: Slope of the position error since this one.


@dataclass(frozen=True)
class GroundResult(Answer):
    """Alignment, stand, shutdown and alignments between, of the INS of the chapter on errors.

    Parameters
    ----------
    ins_topic, gnss_topic : str
        ``gnss_topic`` is empty where no GNSS is compared.
    kind : str
        Of the INS: ``unaided``, ``gnss_aided``, ``unknown``. GNSS holds the errors of an aided one: it has no tilt, no
        drift while standing and no terminal rate.
    start_s : float or None
        Start of navigation, flight seconds; None where nothing proves it.
    mode_flicker : int
        Changes of the logged mode that lasted too short to be an alignment.
    """

    analysis: ClassVar[str] = "ins_ground"
    schema_name: ClassVar[str] = analysis

    ins_topic: str  #: Topic of the INS that is judged.
    gnss_topic: str  #: Topic of the GNSS; empty where none is compared.
    kind: str  #: unaided, gnss_aided or unknown; GNSS holds the errors of an aided one.
    ins_class: str  #: Class whose limits apply.
    start_s: float | None
    alignment: InsAlignment  #: Alignment before navigation; null where none is logged.
    at_start: ErrorsAtStart | None  #: Tilt and azimuth at the start of navigation.
    standing: StandingDrift | None  #: Velocity error while parked, and its drift.
    standing_reason: str  #: Why there is no stretch; empty where there is one.
    shutdown: InsShutdown  #: Errors at the end of the log; null where the aircraft does not stand there.
    realignments: tuple[InsRealignment, ...] = ()  #: Alignments and position sets after the start.
    mode_flicker: int = 0
    figures: tuple[FigureData, ...] = ()
