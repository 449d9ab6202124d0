"""Share of a flight in the fleet that its reference adds: checks of heading and positions."""

import math

from groundstation.results.files import SavedFlight
from groundstation.results.fleet_share import Check, SystemShare, check_of
from groundstation.results.roles import HeadingByTrack
from groundstation.systems.reference.answer import ReferenceResult
from groundstation.systems.reference.arrays import ReferenceChecks
from groundstation.systems.system import InFleet


def share_of(saved: SavedFlight) -> SystemShare:
    """Return the comparisons with the reference; those of the heading have the verdict on it."""
    reference = saved.results.answer(ReferenceResult)
    if reference is None or not reference.is_judge:
        return SystemShare()
    heading = saved.results.answer_meeting(HeadingByTrack)
    verdict = "" if heading is None else heading.verdict
    headings = (check_of("truth_heading", one.difference_deg, one.sigma_deg, verdict) for one in reference.headings)
    positions = _position_checks(saved.rows_of(ReferenceChecks))
    return SystemShare(checks=[check for check in (*headings, *positions) if check is not None])


def _position_checks(checks: ReferenceChecks | None) -> list[Check]:
    """The independent samples of the horizontal positions that claimed something."""
    if checks is None:
        return []
    columns = (checks.subject, checks.quantity, checks.axis)
    rows = zip(*(one.tolist() for one in columns), checks.z, checks.is_inside, strict=True)
    return [
        Check(f"truth_{subject}", float(z), bool(is_inside))
        for subject, quantity, axis, z, is_inside in rows
        if (quantity, axis) == ("position", "horizontal") and math.isfinite(z)
    ]


IN_FLEET = InFleet(share=share_of)
