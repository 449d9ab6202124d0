"""Several INS of one flight: each against the reference, in pairs, and which one is off."""

from collections.abc import Sequence

from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units_answer import UnitsResult
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack


def judge_units(
    units: Sequence[UnitTrack],
    reference: ReferenceTrack | None = None,
    *,
    settings: InertialSettings | None = None,
    ins_class: str = "navigation",
    ins_class_origin: str = "default",
) -> UnitsResult:
    """Hold several INS of one flight against a reference and against each other.

    Parameters
    ----------
    units : sequence of UnitTrack
        Two or more.
    reference : ReferenceTrack, optional
        GNSS or the best trajectory; it may have gaps.
    settings : InertialSettings, optional
    ins_class : str
        Class whose simulated units are the reference distribution of what honest units do.

    Raises
    ------
    NotAssessableError
        When no two units overlap.
    """
    raise NotImplementedError
