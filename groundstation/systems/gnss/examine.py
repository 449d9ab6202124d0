"""Shortfalls of a log for a full answer on its GNSS reception."""

from groundstation.systems.analysis import Shortfall
from groundstation.systems.gnss.answer import WITHOUT_FIX, GnssReceiver
from groundstation.systems.gnss.estimate import reception_of
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.gnss.wording_answer import never_had
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight


def shortfalls_of(flight: Flight, phases: Phases, settings: GnssSettings) -> tuple[Shortfall, ...]:
    """Return what the main receiver lacks: a fix, fields that are not logged, a standstill.

    Raises
    ------
    NotAssessableError
        When the log has no row of a receiver.
    """
    main = reception_of(flight, phases, settings=settings).answer.receiver
    if main.first_fix_s is None:
        return (Shortfall(never_had(main), ((main.start_s, main.end_s),)),)
    lost = tuple((loss.start_s, loss.end_s) for loss in main.losses if loss.state in WITHOUT_FIX)
    found = [Shortfall("no fix after the first one", lost)] if lost else []
    missing = not_logged(main)
    if missing:
        found.append(Shortfall(f"not logged: {', '.join(missing)}"))
    if main.standstill is None:
        text = f"no standstill of {settings.standstill_min_s:g} s: claimed accuracy is not judged by scatter"
        found.append(Shortfall(text))
    return tuple(found)


def not_logged(one: GnssReceiver) -> tuple[str, ...]:
    """Return what would tell of a receiver's reception and is not logged, in words."""
    told = {
        "kind of fix": one.is_kind_logged or None,
        "satellites": one.satellites_used,
        "DOP": one.hdop if one.pdop is None else one.pdop,
        "claimed accuracy": one.velocity_sigma_mps if one.horizontal_sigma_m is None else one.horizontal_sigma_m,
        "velocity": one.motion,
    }
    return tuple(name for name, value in told.items() if value is None)
