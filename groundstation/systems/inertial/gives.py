"""Parts of the inertial page that a log gives, for ``check --for inertial``."""

from groundstation.base.signals import topics_of_kind
from groundstation.systems.inertial.alignment_findings import told_by_ground
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units_findings import told_by_units
from groundstation.systems.known import Known
from groundstation.tables.sources import is_mostly_aided
from groundstation.tables.table import Flight

FIELD = ("field_forward_nt", "field_right_nt")


def given_by(flight: Flight, _known: Known, _settings: InertialSettings) -> tuple[str, ...]:
    """Return what a log gives beside the errors of one INS, a line each."""
    return (*told_by_units(flight), *told_by_ground(flight), *_told_by_flux_valve(flight))


def _told_by_flux_valve(flight: Flight) -> tuple[str, ...]:
    """Return the line of a magnetic heading that comes without a field."""
    topics = [one for one in topics_of_kind("ins", flight.topics()) if flight[one].has("magnetic_heading_deg")]
    has_field = any(flight[one].has(*FIELD) for one in topics_of_kind("magnetometer", flight.topics()))
    if not topics or has_field or is_mostly_aided(flight[topics[0]]):
        return ()
    return (f"flux valve: the magnetic heading of {topics[0]} alone, its deviation by turns and legs",)
