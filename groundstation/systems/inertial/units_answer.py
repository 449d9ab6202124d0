"""Answer on several INS of one flight: each against GNSS, in pairs, and which one is off."""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData

UnitState = Literal["good", "off", "one_of", "aided", "copy", "not_judged"]
FaultKind = Literal["drift", "tilt", "step", "swapped_axis", "stuck", "frozen", "heading"]
Verdict = Literal["agree", "off", "one_of", "not_judged"]
UNIT_STATES: tuple[str, ...] = ("good", "off", "one_of", "aided", "copy", "not_judged")
SAME_HEADING_DEG = 0.5  # between two records of one unit
LEAST_S = 120.0  # of two units together: in less they are not judged
FAULT_KINDS: tuple[str, ...] = ("drift", "tilt", "step", "swapped_axis", "stuck", "frozen", "heading")
VERDICTS: tuple[str, ...] = ("agree", "off", "one_of", "not_judged")


@dataclass(frozen=True)
class Measured:
    """Value with half of its 95 % interval.

    The interval is that of the measurement: what the noise of the reference may do to the value.
    """

    schema_name: ClassVar[str] = "measured"

    value: float  #: Best estimate.
    half95: float  #: Half of the 95 % interval of the measurement.


@dataclass(frozen=True)
class InsFault:
    """Fault of a unit, or of one of two.

    Parameters
    ----------
    kind : str
    topics : tuple of str
        The unit; two where it may be either.
    start_s, end_s : float or None
        Flight seconds of a fault that has a place.
    value, half95, unit
        Size, with half of its 95 % interval where it has one: nmi/h of a drift, m/s of a tilt (Schuler amplitude), m or
        m/s of a step, deg of a heading; None where the kind has no size.
    limit : float or None
        Exceeded by an honest unit of the class in :attr:`UnitsResult.false_alarm_share` of flights.
    by : str
        Words for what shows it: "against gnss", "by three units", "by its own velocity".
    text : str
        The fault in words, without its topic.
    """

    schema_name: ClassVar[str] = "ins_fault"

    #: drift, tilt, step, swapped_axis, stuck, frozen or heading.
    kind: FaultKind = field(metadata={"one_of": FAULT_KINDS})
    topics: tuple[str, ...]
    by: str
    text: str
    start_s: float | None = None  #: Flight second at which it begins; null of a fault without a place.
    end_s: float | None = None  #: Flight second at which it ends; null of a fault without a place.
    value: float | None = None  #: Size of the fault in `unit`; null where the kind has none.
    half95: float | None = None  #: Half of its 95 % interval, where it has one.
    unit: str = ""  #: nmi/h of a drift, m/s of a tilt (Schuler amplitude), m or m/s of a step, deg of a heading.
    limit: float | None = None


@dataclass(frozen=True)
class InsUnit:
    """One INS of a flight, with its errors against the reference.

    Parameters
    ----------
    topic : str
    serials : tuple of str
        In order of time; more than one where the serial changes in flight, none where it is not stated.
    kind, kind_reason : str
        As of :class:`groundstation.systems.inertial.answer.InertialResult`.
    has_position : bool
    start_s : float or None
        When navigation began, flight seconds; None where nothing proves it: the rate is then the growth inside the log.
    compared_hours : float or None
        Hours from the start of navigation, or of the log, to the last comparison with the reference.
    rate_fit_nmiph : Measured or None
        Slope through the origin of the radial error.
    rate_50_nmiph, rate_95_nmiph : float or None
        Error over time, median and 95 %, later than ten minutes; None where the start is not known.
    velocity_rms_mps, schuler_mps : Measured or None
        Velocity error RMS, and the amplitude of its part with the Schuler period.
    largest_m : Measured or None
    largest_at_s : float or None
    heading_difference_deg : float or None
        Median of the heading less that of the trajectory.
    lag_s : Measured or None
        Time by which its clock is behind that of the first unit; taken off before the comparison.
    same_as : str
        Topic of the unit whose numbers it repeats.
    ins_class : str
        Class of its limits.
    state : str
        ``off``: named as faulty; ``one_of``: it or another; ``aided``: GNSS corrects it, so it is no witness;
        ``copy``: it repeats another.
    """

    schema_name: ClassVar[str] = "ins_unit"

    topic: str  #: Topic of the INS.
    kind: str  #: unaided, gnss_aided or unknown.
    kind_reason: str  #: What shows the kind, for people.
    has_position: bool  #: Whether it logs a position.
    state: UnitState = field(metadata={"one_of": UNIT_STATES})
    serials: tuple[str, ...] = ()
    start_s: float | None = None
    compared_hours: float | None = None
    rate_fit_nmiph: Measured | None = None
    #: Median of radial error over time, later than ten minutes; null where the start is not known.
    rate_50_nmiph: float | None = None
    rate_95_nmiph: float | None = None  #: 95th percentile of the same.
    velocity_rms_mps: Measured | None = None  #: RMS of the horizontal velocity error.
    schuler_mps: Measured | None = None  #: Amplitude of the velocity error with the Schuler period.
    largest_m: Measured | None = None  #: Largest radial position error.
    largest_at_s: float | None = None  #: Flight second of that error.
    heading_difference_deg: float | None = None
    lag_s: Measured | None = None
    same_as: str = ""
    ins_class: str = ""


@dataclass(frozen=True)
class InsPair:
    """Second unit less the first one.

    The intervals are those of what both units write: rounding and noise. The limits are what two honest units of their
    classes exceed in :attr:`UnitsResult.false_alarm_share` of flights; None where the pair is not judged, ``why_not``
    says why. Without ``is_start_known`` the rate is the growth inside the log.
    """

    schema_name: ClassVar[str] = "ins_pair"

    first: str  #: Topic of one unit.
    second: str  #: Topic of the other.
    hours: float  #: Time compared.
    rate_fit_nmiph: Measured | None  #: Growth of the distance between them, slope through the origin.
    velocity_rms_mps: Measured | None  #: RMS of the difference of their velocities.
    schuler_mps: Measured | None  #: Amplitude of that difference with the Schuler period.
    largest_m: Measured | None  #: Largest distance between them.
    heading_difference_deg: Measured | None  #: Median of second minus first heading.
    is_start_known: bool = False  #: Whether the start of navigation of both is known: else no rate is judged.
    rate_limit_nmiph: float | None = None  #: Limit of the growth for two honest units.
    velocity_limit_mps: float | None = None  #: Limit of the velocity difference.
    heading_limit_deg: float | None = None  #: Limit of the heading difference.
    is_beyond: bool = False  #: Whether a limit is exceeded.
    why_not: str = ""  #: Why the pair is not judged; empty where it is.


@dataclass(frozen=True)
class UnitsResult(Answer):
    """Several INS of one flight.

    Parameters
    ----------
    verdict : str
        ``agree``: no unit is off; ``off``: the ones in ``off`` are; ``one_of``: one of those in ``off`` is, the log
        does not tell which; ``not_judged``: nothing that could tell.
    against : str
        Topic of the reference, empty where there is none.
    against_title : str
        The same in words.
    false_alarm_share : float
        Share of the flights of honest units in which a single limit is exceeded.
    is_common : bool
        Whether all units are beyond their limits against the reference and agree with each other.
    """

    analysis: ClassVar[str] = "ins_units"
    schema_name: ClassVar[str] = analysis

    verdict: Verdict = field(metadata={"one_of": VERDICTS})
    sentence: str  #: Conclusion for people.
    off: tuple[str, ...]  #: Topics of the units that are off, or of which one is.
    units: tuple[InsUnit, ...]  #: Every INS against the reference.
    pairs: tuple[InsPair, ...]  #: Every two INS against each other.
    faults: tuple[InsFault, ...]  #: When and how a unit went wrong.
    against: str
    against_title: str  #: The reference in words.
    ins_class: str  #: Class whose limits apply.
    ins_class_origin: str  #: Where the class comes from, in words.
    false_alarm_share: float
    is_common: bool = False
    figures: tuple[FigureData, ...] = ()

    def unit(self, topic: str) -> InsUnit:
        """Return the unit of a topic."""
        return next(one for one in self.units if one.topic == topic)

    def against_copy(self, unit: InsUnit) -> tuple[str, ...]:
        """Return what speaks against a unit that repeats another being the same one, in words."""
        if not unit.same_as:
            return ()
        both = {unit.topic, unit.same_as}
        apart = next((one.heading_difference_deg for one in self.pairs if {one.first, one.second} == both), None)
        found = []
        if apart is not None and abs(apart.value) > SAME_HEADING_DEG:
            found.append(f"its heading stands {abs(apart.value):.1f} deg apart")
        serials = unit.serials, self.unit(unit.same_as).serials
        if all(serials) and not set(serials[0]) & set(serials[1]):
            found.append(f"it states another serial ({', '.join(serials[0])}, {', '.join(serials[1])})")
        return tuple(found)
