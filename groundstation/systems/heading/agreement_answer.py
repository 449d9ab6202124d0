"""Azimuth error of an INS by taxi beside that by the turns of the flight."""

import math

from groundstation.results.agreement import Agreement, OneFinding
from groundstation.results.answer import Answers, answer_meeting, answer_of
from groundstation.results.roles import AzimuthByTurns
from groundstation.systems.heading.answer import HeadingResult

DRIFT_SIGMA_DEG_PER_H = 0.1  # drift of the azimuth of an INS between two looks at it
S_PER_H = 3600.0


def heading_agreement(answers: Answers) -> Agreement | None:
    """Compare the platform's azimuth error by taxi and by turns.

    Both are of the same INS; the turns are in flight.
    """
    taxi, flown = answer_of(answers, HeadingResult), answer_meeting(answers, AzimuthByTurns)
    turns = flown.azimuth if flown is not None else None
    if taxi is None or flown is None or turns is None or taxi.ins_topic != flown.ins_topic:
        return None
    if turns.error_deg is None or turns.sigma_deg is None or not all(map(math.isfinite, taxi.azimuth)):
        return None
    hours = 0.0 if turns.time_s is None else abs(turns.time_s - (taxi.reference_time_s or 0.0)) / S_PER_H
    return Agreement(
        "azimuth error of the INS",
        "deg",
        OneFinding("by taxi", *taxi.azimuth),
        OneFinding("by turns in flight", turns.error_deg, turns.sigma_deg),
        DRIFT_SIGMA_DEG_PER_H * hours,
    )
