"""Parts of the inertial page that a log gives, for ``check --for inertial``."""

from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.systems.inertial.alignment_findings import told_by_ground
from groundstation.systems.inertial.causes import ONE_HEADING, heading_spread
from groundstation.systems.inertial.examine import compared_with_kind
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units_findings import told_by_units
from groundstation.systems.known import Known
from groundstation.tables.sources import UNAIDED, is_mostly_aided
from groundstation.tables.table import Flight

FIELD = ("field_forward_nt", "field_right_nt")


def given_by(flight: Flight, known: Known, settings: InertialSettings) -> tuple[str, ...]:
    """Return what a log gives beside the errors of one INS, a line each."""
    causes = _told_by_causes(flight, known, settings)
    return (*told_by_units(flight), *causes, *told_by_ground(flight), *_told_by_flux_valve(flight))


def _told_by_causes(flight: Flight, known: Known, settings: InertialSettings) -> tuple[str, ...]:
    """Return the line of errors by cause; nothing where the errors are not estimated."""
    try:
        compared, (kind, _reason) = compared_with_kind(flight, known, settings)
    except NotAssessableError:
        return ()
    if kind != UNAIDED:
        return ()
    is_parted = heading_spread(compared) > ONE_HEADING
    body = "in axes of the body too" if is_parted else "not in axes of the body: one heading"
    return (f"causes: Schuler, drift, along and across the track, by leg, {body}",)


def _told_by_flux_valve(flight: Flight) -> tuple[str, ...]:
    """Return the line of a magnetic heading that comes without a field."""
    topics = [one for one in topics_of_kind("ins", flight.topics()) if flight[one].has("magnetic_heading_deg")]
    has_field = any(flight[one].has(*FIELD) for one in topics_of_kind("magnetometer", flight.topics()))
    if not topics or has_field or is_mostly_aided(flight[topics[0]]):
        return ()
    return (f"flux valve: the magnetic heading of {topics[0]} alone, its deviation by turns and legs",)
