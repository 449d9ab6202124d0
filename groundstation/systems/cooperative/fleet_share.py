"""Row of a session in the fleet: the algorithm to trust, and its accuracy."""

from dataclasses import replace

from groundstation.results.files import SavedFlight
from groundstation.results.fleet import SessionRow
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.chapter import REFERENCE, trusted
from groundstation.systems.system import InFleet


def with_algorithm(saved: SavedFlight, row: SessionRow) -> SessionRow:
    """Return the row of a session with its algorithm to trust, where it has one."""
    answer = saved.results.answer(CooperativeResult)
    if answer is None or not answer.algorithms:
        return row
    best, reckoned = trusted(answer), next((one for one in answer.algorithms if one.algorithm == REFERENCE), None)
    return replace(
        row,
        algorithm=best.algorithm,
        two_sigma_r_m=best.two_sigma_r_m,
        reckoned_two_sigma_r_m=reckoned.two_sigma_r_m if reckoned else None,
        rms_m=best.rms_m,
        is_consistent=best.is_consistent,
        diverges=best.diverges,
    )


IN_FLEET = InFleet(row=with_algorithm)
