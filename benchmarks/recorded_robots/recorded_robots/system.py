"""Recorded robots as a system: a study on sets of recorded vehicles."""

from collections.abc import Callable
from pathlib import Path

from groundstation.systems.study import StudyResult
from groundstation.systems.system import Study, System


def _study() -> Callable[..., StudyResult]:
    from recorded_robots.sets import recorded_sets
    from recorded_robots.study import study_recorded

    def study(*, runs: int, seed: int, progress: Callable[[str], None], inputs: Path) -> StudyResult:
        return study_recorded(recorded_sets(inputs), progress)

    return study


SYSTEM = System(
    name="recorded_robots",
    studies=(
        Study(
            "recorded",
            "navigation between vehicles: every algorithm on sets of UTIAS, MILUV and MURP, against motion capture",
            _study,
            reads="a folder with sets of recorded robots",
        ),
    ),
)
