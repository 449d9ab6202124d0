"""Findings on several units, and the run of their comparison on a flight."""

from itertools import pairwise

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.words import listed
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units import judge_units
from groundstation.systems.inertial.units_answer import InsFault, InsUnit, UnitsResult
from groundstation.systems.inertial.units_log import GNSS, unit_class, unit_reference, unit_topics, unit_tracks
from groundstation.systems.inertial.units_verdict import COMMON
from groundstation.systems.known import Known
from groundstation.tables.sources import AIDED, choose_source
from groundstation.tables.table import Flight

LATE_S = 0.05


def compare_units(flight: Flight, known: Known, settings: InertialSettings) -> tuple[UnitsResult, tuple[Finding, ...]]:
    """Compare the units of a flight.

    Raises
    ------
    NotAssessableError
        With the reason.
    """
    noise, origin = unit_class(flight, known, settings)
    tracks = unit_tracks(flight, known, settings)
    reference = unit_reference(flight, known, noise)
    found = judge_units(tracks, reference, ins_class=noise.name, ins_class_origin=origin)
    changes = {one.topic: one.serials for one in tracks}
    findings = [_of_fault(one) for one in found.faults]
    if found.is_common:
        findings.append(Finding("warn", "ins_units.common", COMMON, found.against, count=len(found.units)))
    for unit in found.units:
        findings += _of_unit(unit, changes[unit.topic], found.against_copy(unit))
    return found, tuple(findings)


def _of_fault(fault: InsFault) -> Finding:
    place = ""
    if fault.start_s is not None and fault.end_s is not None:
        at = f"at {fault.start_s:.1f} s"
        place = at if fault.start_s == fault.end_s else f"{fault.start_s:.1f} to {fault.end_s:.1f} s"
    who = "" if len(fault.topics) == 1 else f"one of {listed(fault.topics)}: "
    topic = fault.topics[0] if len(fault.topics) == 1 else ""
    return Finding("warn", f"ins_units.{fault.kind}", f"{who}{fault.text}, {fault.by}", topic, place)


def _of_unit(unit: InsUnit, serials: tuple[tuple[float, str], ...], against_copy: tuple[str, ...]) -> list[Finding]:
    found = []
    if unit.same_as:
        text = f"it repeats {unit.same_as}: the same unit twice, counted once"
        if against_copy:
            text = f"it repeats position and velocity of {unit.same_as}, counted once; yet {listed(against_copy)}"
        found.append(Finding("warn", "ins_units.same", text, unit.topic))
    if unit.lag_s is not None and abs(unit.lag_s.value) > max(LATE_S, 1.5 * unit.lag_s.half95):
        late = "late" if unit.lag_s.value > 0.0 else "early"
        text = f"its clock is {abs(unit.lag_s.value):.3f} ± {unit.lag_s.half95:.3f} s {late}: taken off"
        found.append(Finding("warn", "ins_units.clock", text, unit.topic))
    if not unit.has_position:
        found.append(Finding("info", "ins_units.no_position", "no position: only its velocity is compared", unit.topic))
    if unit.kind == AIDED:
        text = f"GNSS corrects it ({unit.kind_reason}): it is no witness against the others"
        found.append(Finding("info", "ins_units.aided", text, unit.topic))
    for (_, before), (at_s, after) in pairwise(serials):
        text = f"its serial changes from {before} to {after}: its errors are those of two units"
        found.append(Finding("warn", "ins_units.serial", text, unit.topic, f"at {at_s:.1f} s"))
    return found


def told_by_units(flight: Flight) -> tuple[str, ...]:
    """Return what several units of a log let one tell, in words; nothing of one unit.

    Examples
    --------
    >>> from groundstation.tables.assemble import flight_from_batches
    >>> told_by_units(flight_from_batches((), metadata={}, has_utc=False, source_name="none"))
    ()
    """
    topics = unit_topics(flight)
    if len(topics) < 2:
        return ()
    names = listed(topics)
    try:
        gnss = choose_source(flight, GNSS, "ins_units")
    except NotAssessableError:
        says = "parity names the one that is off" if len(topics) > 2 else "a difference shows, not which one is off"
        return (f"several units ({names}) without GNSS: {says}",)
    return (f"several units ({names}): each against {gnss}, and in pairs",)
