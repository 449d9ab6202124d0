"""Findings on the INS on the ground, and the run of the analysis."""

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.systems.inertial.alignment import VELOCITIES, ground_result
from groundstation.systems.inertial.alignment_answer import GroundResult
from groundstation.systems.inertial.alignment_modes import still_until_s
from groundstation.systems.inertial.mode_spans import mode_spans
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.known import Known
from groundstation.tables.sources import choose_source
from groundstation.tables.table import Flight

AT_END_S = 60.0
NAME = "ins_ground"


def assess_ground(flight: Flight, known: Known, settings: InertialSettings) -> tuple[GroundResult, tuple[Finding, ...]]:
    """Describe the INS on the ground, with findings.

    Raises
    ------
    NotAssessableError
        With the reason.
    """
    found = ground_result(flight, known, settings)
    return found, tuple(_findings(found))


def _findings(found: GroundResult) -> list[Finding]:
    before, standing, topic = found.alignment, found.standing, found.ins_topic
    told = []
    if before.is_moved and before.kind != "in_motion":
        far = "" if before.moved_m is None else f", by up to {before.moved_m:.1f} m"
        text = f"the aircraft moved while the INS aligned{far}: its tilt and azimuth are doubtful"
        place = "" if before.moved_at_s is None else f"at {before.moved_at_s:.1f} s"
        told.append(Finding("warn", "ins_ground.moved", text, topic, place))
    if standing is not None and standing.is_above and standing.limit_mps_per_min is not None:
        size = standing.size_mps_per_min
        text = (
            f"ground speed drifts by {size.value:.3f} +- {size.half95:.3f} m/s per min while the aircraft stands after "
            f"the alignment, {standing.limit_mps_per_min:.3f} for the class {found.ins_class}"
        )
        place = f"{standing.start_s:.1f} to {standing.end_s:.1f} s"
        told.append(Finding("warn", "ins_ground.standing_drift", text, topic, place))
    if found.mode_flicker:
        text = "the logged mode changes between alignment and navigation for less than 5 s: taken for a flicker"
        told.append(Finding("info", "ins_ground.flicker", text, topic, count=found.mode_flicker))
    return told


def told_by_ground(flight: Flight) -> tuple[str, ...]:
    """Return what a log gives of alignment and shutdown, a line each; nothing without an INS.

    Examples
    --------
    >>> from groundstation.tables.assemble import flight_from_batches
    >>> told_by_ground(flight_from_batches((), metadata={}, has_utc=False, source_name="none"))
    ()
    """
    try:
        topic = choose_source(flight, VELOCITIES, NAME)
    except NotAssessableError:
        return ()
    return (f"alignment: {_alignment_told(flight, topic)}", f"shutdown: {_shutdown_told(flight, topic)}")


def _alignment_told(flight: Flight, topic: str) -> str:
    modes = mode_spans(flight, topic)
    if modes.spans_s:
        return f"by the logged mode, {modes.spans_s[0][1] - modes.spans_s[0][0]:.0f} s"
    still = still_until_s(flight, topic)
    if still is not None:
        return f"by velocities of exactly zero for {still[1] - still[0]:.0f} s"
    return "not in the log" + ("" if modes.is_logged else " (no mode of the INS)")


def _shutdown_told(flight: Flight, topic: str) -> str:
    from groundstation.systems.inertial.alignment_stands import ground_motion
    from groundstation.systems.inertial.differences import navigating

    ins, _ = navigating(flight[topic].unique_times())
    gnss = flight["gnss"].unique_times() if "gnss" in flight else None
    spans = ground_motion(flight, ins, gnss).spans() if len(ins) else ()
    last_s = float(flight.time_s(topic)[-1])
    if not spans or spans[-1][1] < last_s - AT_END_S:
        return "the log ends in motion: last error alone"
    has_gnss = gnss is not None and len(gnss) > 0 and float(flight.time_s("gnss")[-1]) > spans[-1][0]
    return "parked at the end, " + ("with GNSS" if has_gnss else "without GNSS: residual ground speed alone")
