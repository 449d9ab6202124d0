"""Shortfalls of a flight for the magnetic deviation, from what was flown."""

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.methods.roles import InsKinds
from groundstation.results.roles import Delays
from groundstation.systems.analysis import Shortfall
from groundstation.systems.known import Known
from groundstation.systems.magnetic.earth import earth_field
from groundstation.systems.magnetic.flown import FlownTurns, find_flown
from groundstation.systems.magnetic.held_out import find_unseen, is_level
from groundstation.systems.magnetic.readings import ANALYSIS, choose_topics
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.table import Flight


def examine_magnetic(flight: Flight, known: Known, settings: MagneticSettings) -> tuple[Shortfall, ...]:
    """Judge the turns of a flight.

    Turns must cover the circle, and level flight be there to judge by.

    Raises
    ------
    NotAssessableError
        Where nothing can be estimated, with the reason that the estimate would give.
    """
    topics = _topics(flight)
    flown = find_flown(flight, topics, known.phases, _kinds(flight, known), known.answer_meeting(Delays), settings)
    rows = np.sort(np.concatenate([one.rows(right) for one in flown.figures for right in (True, False)]))
    earth_field(flight, flown.readings, rows, settings)
    found = []
    share = max(one.covered_share for one in flown.figures)
    if share < settings.coverage_min:
        text = f"opposite turns cover {share:.0%} of the circle, {settings.coverage_min:.0%} needed"
        found.append(Shortfall(text, tuple((one.start_s, one.end_s) for one in flown.figures)))
    level = _level_readings(flown, settings)
    if level < settings.held_out_samples_min:
        found.append(Shortfall(f"no level flight beside the figure to judge by ({level} readings)"))
    return tuple(found)


def _topics(flight: Flight) -> tuple[str, str]:
    """Return INS and magnetometer; of a log with heading alone say what serves it."""
    try:
        return choose_topics(flight)
    except NotAssessableError as error:
        if not any(flight[topic].has("magnetic_heading_deg") for topic in topics_of_kind("ins", flight.topics())):
            raise
        text = f"{error.found}; a magnetic heading alone is judged by magnetic_flux and magnetic_ground"
        raise NotAssessableError(ANALYSIS, text, error.expected, error.next_step) from error


def _kinds(flight: Flight, known: Known) -> dict[str, str]:
    """Tell whether GNSS corrects the INS, as the inertial analysis would say."""
    kinds = known.role(InsKinds)
    return {} if kinds is None else kinds.find(flight)


def _level_readings(flown: FlownTurns, settings: MagneticSettings) -> int:
    unseen = find_unseen(flown.readings, flown.is_airborne, flown.figures, settings)
    return int(np.count_nonzero(unseen & is_level(flown.readings, settings)))
