"""Best trajectory as an analysis: of every log with an inertial unit."""

from typing import TYPE_CHECKING

from groundstation.base.signals import topics_of_kind
from groundstation.results.answer import Answers, answer_of
from groundstation.systems.analysis import Analysis, Found, Shortfall
from groundstation.systems.known import Known
from groundstation.systems.trajectory.answer import BestTrajectory
from groundstation.systems.trajectory.columns import COLUMNS
from groundstation.systems.trajectory.settings import TrajectorySettings

if TYPE_CHECKING:
    from groundstation.tables.table import Flight


def _run(flight: "Flight", known: Known, settings: TrajectorySettings) -> Found[BestTrajectory]:
    from groundstation.systems.trajectory.examine import advised
    from groundstation.systems.trajectory.solve import solve

    with advised(flight):
        answer, findings, workings = solve(flight, known, settings)
    return Found(answer, findings, workings)


def _examine(flight: "Flight", known: Known, settings: TrajectorySettings) -> tuple[Shortfall, ...]:
    from groundstation.systems.trajectory.examine import examine_trajectory

    return examine_trajectory(flight, known, settings)


def _has_unit(flight: "Flight", _known: Known) -> bool:
    return bool(topics_of_kind("imu", flight.topics()))


def _sentence(answers: Answers) -> str:
    from groundstation.systems.trajectory.wording_answer import line_of

    answer = answer_of(answers, BestTrajectory)
    return "" if answer is None else line_of(answer)


TRAJECTORY = Analysis(
    name="trajectory",
    title="best trajectory: raw inertial data and GNSS, smoothed, with the errors of the on-board filter",
    subject="trajectory",
    page_title="Best trajectory",
    needs="an inertial unit's increments or samples (topic imu) with GNSS position and velocity; a minute of motion",
    settings=TrajectorySettings,
    answer=BestTrajectory,
    run=_run,
    applies=_has_unit,
    sentence=_sentence,
    columns=COLUMNS,
    examine=_examine,
)
