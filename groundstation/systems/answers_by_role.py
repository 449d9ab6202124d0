"""Answers of other systems that a study needs of its simulated flights, asked by role."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from groundstation.base.errors import NotAssessableError
from groundstation.systems import systems
from groundstation.systems.known import Known
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight


def answered(flight: Flight, phases: Phases, roles: Sequence[type[Any]]) -> Known:
    """Return what is known of a flight once the analyses that play some roles have run.

    Settings are the shipped ones. A role has no answer where no system plays it, or the data do not allow it.

    Parameters
    ----------
    flight : Flight
    phases : Phases
        As the analyses are told of them.
    roles : sequence of type
        Roles of answers (:mod:`groundstation.results.roles`): the first analysis that plays each of them runs, in this
        order, and is given the answers before it.
    """
    known = Known(phases, roles=systems().roles)
    for role in roles:
        analysis = next((one for one in systems().analyses if issubclass(one.answer, role)), None)
        if analysis is None:
            continue
        try:
            found = analysis.run(flight, known, known.settings_of(analysis.settings))
        except NotAssessableError:
            continue
        known = replace(known, answers={**known.answers, analysis.name: found.answer})
    return known
