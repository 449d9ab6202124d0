"""Flight data for the deviation: readings with attitude, turns of steady bank, figures.

The turns make the figures.
"""

from collections.abc import Mapping

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray
from groundstation.results.arrays.states import BodyStates
from groundstation.results.roles import Delays
from groundstation.systems.magnetic.manoeuvre import FoundTurn, OppositeTurns, find_figures, find_turns
from groundstation.systems.magnetic.readings import ANALYSIS, Readings, gather, why_not_independent
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight

IN_THE_AIR = ("airborne", "unknown")  # ground contact is a phase of its own where it is proven


@dataclass(frozen=True)
class FlownTurns:
    """Readings, those in the air, figures and turns found, and the latency taken off."""

    readings: Readings
    is_airborne: BoolArray
    figures: list[OppositeTurns]
    turns: list[FoundTurn]
    latency_s: float


def find_flown(
    flight: Flight,
    topics: tuple[str, str],
    phases: Phases,
    kinds: Mapping[str, str],
    latencies: Delays | None,
    settings: MagneticSettings,
    states: BodyStates | None = None,
) -> FlownTurns:
    """Find the opposite turns of a flight; parameters as of ``estimate_deviation``.

    ``states`` give attitude and heading in place of the INS.

    Raises
    ------
    NotAssessableError
        With the reason: no independent heading, hardly a reading, no figure.
    """
    objection = "" if states is not None else why_not_independent(flight, topics[0], dict(kinds), settings)
    if objection:
        raise NotAssessableError(ANALYSIS, objection)
    readings, latency_s = gather(flight, topics, latencies, settings, states)
    is_airborne = np.isin(phases.at(readings.time_s), IN_THE_AIR)
    figures, turns = find_figures(readings, find_turns(readings, is_airborne, settings), settings)
    if not figures:
        raise NotAssessableError(ANALYSIS, _why_no_figure(turns))
    return FlownTurns(readings, is_airborne, figures, turns, latency_s)


def _why_no_figure(turns: list[FoundTurn]) -> str:
    """Tell what was found instead of a figure, the longest turns first."""
    if not turns:
        return "no turn of steady bank in flight: opposite turns over the whole circle are needed"
    longest = sorted(turns, key=lambda one: -abs(one.turn.turned_deg))[:3]
    told = "; ".join(
        f"at {one.turn.start_s:.0f} s {one.turn.turned_deg:+.0f} deg at {one.turn.bank_deg:+.0f} deg of bank: "
        f"{one.turn.reason}"
        for one in longest
    )
    return f"no opposite turns that cover the circle: {told}"
