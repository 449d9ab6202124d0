"""States of their own as reference of attitude and heading, in place of the INS.

No magnetometer is in them.
"""

import math

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.results.arrays.states import BodyStates
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.known import AircraftData
from groundstation.systems.magnetic.answer import Alignment, AlignmentSource
from groundstation.systems.magnetic.readings import ANALYSIS
from groundstation.systems.magnetic.settings import MagneticSettings


@dataclass(frozen=True)
class StatesReference:
    """States that may be a reference, and words on them: "by the best trajectory"."""

    states: BodyStates
    by: str


def reference_of(answer: StatesAlongTheFlight | None, settings: MagneticSettings) -> StatesReference | None:
    """Return the states of an answer.

    None where its checks do not hold, or the settings want none.
    """
    if answer is None or not answer.is_reference or settings.states_sigma_max_deg == 0.0:
        return None
    states = answer.body_states()
    return None if states is None else StatesReference(states, answer.by_it)


def aligned_by_states(
    reference: StatesReference,
    ins_topic: str,
    times_s: FloatArray,
    figure_at_s: float,
    settings: MagneticSettings,
    aircraft: AircraftData,
) -> Alignment:
    """Return what aligns where the states are the reference.

    Nothing is removed, theirs is the sigma.

    It is that of their heading at the readings of the figures, taken as one error, with that of the mounting of the
    unit, for which the one of the INS stands.

    Raises
    ------
    NotAssessableError
        Where the heading of the states is less sure than the settings want.
    """
    mounting = settings.mounting_sigma_deg if aircraft.mounting_sigma_deg is None else aircraft.mounting_sigma_deg
    own = float(np.nanmedian(reference.states.at(times_s).true_heading_sigma_deg))
    sigma, most = math.hypot(own, mounting), settings.states_sigma_max_deg
    if most is not None and sigma > most:
        raise NotAssessableError(ANALYSIS, f"heading {reference.by} has a sigma of {sigma:.2f} deg, limit {most:g}")
    return Alignment(
        origin=f"roll, pitch and heading {reference.by} in place of those of {ins_topic}",
        error_deg=0.0,
        sigma_deg=sigma,
        aligned_error_deg=0.0,
        aligned_sigma_deg=sigma,
        drift_deg_per_h=0.0,
        drift_sigma_deg_per_h=0.0,
        aligned_at_s=figure_at_s,
        figure_at_s=figure_at_s,
        sources=(AlignmentSource("states", 0.0, sigma, figure_at_s, True),),
    )


def not_taken(sigma_deg: float, at_s: float) -> AlignmentSource:
    """Return the states as a source that is not used: the aligned INS is surer."""
    return AlignmentSource("states", None, sigma_deg, at_s, False, "the aligned INS heading is surer")
