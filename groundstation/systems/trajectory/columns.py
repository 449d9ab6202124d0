"""Columns that the best trajectory gives to the tables of flights."""

from collections.abc import Callable

from groundstation.results.columns import AnswerColumn
from groundstation.systems.trajectory.answer import ARM, LATENCY, VELOCITY_LAG, BestTrajectory
from groundstation.systems.trajectory.quantity_answer import Quantity

OUTAGE_S = 60.0


def _median_sigma(quantity: Quantity) -> Callable[[BestTrajectory], float | None]:
    def of(answer: BestTrajectory) -> float | None:
        row = answer.accuracy_of(quantity)
        return None if row is None or answer.state == "ambiguous" else row.median_sigma

    return of


def _onboard_rms(*quantities: Quantity) -> Callable[[BestTrajectory], float | None]:
    """Return the RMS error of the on-board filter, the larger of several.

    None where the answer is not accepted.
    """

    def of(answer: BestTrajectory) -> float | None:
        if answer.onboard is None or not answer.is_reference:
            return None
        rows = [row for quantity in quantities if (row := answer.onboard.row(quantity)) is not None]
        return max((row.rms for row in rows), default=None)

    return of


def _seen(name: str) -> Callable[[BestTrajectory], float | None]:
    """Return a parameter that the log shows; None where it does not."""

    def of(answer: BestTrajectory) -> float | None:
        found = answer.parameter(name)
        return None if found is None or not found.is_observable else found.value

    return of


def _outage_m(answer: BestTrajectory) -> float | None:
    return next((row.smoothed_rms_m for row in answer.outages if row.length_s == OUTAGE_S), None)


COLUMNS: tuple[AnswerColumn[BestTrajectory], ...] = (
    AnswerColumn("trajectory_state", "category", "accepted, doubtful or ambiguous", lambda answer: answer.state),
    AnswerColumn(
        "trajectory_heading_sigma_deg",
        "number",
        "sigma of the trajectory's heading, median; none where it is ambiguous",
        _median_sigma("heading"),
    ),
    AnswerColumn(
        "onboard_heading_rms_deg",
        "number",
        "heading error of the on-board filter against an accepted trajectory, RMS, constant offset taken off",
        _onboard_rms("heading"),
    ),
    AnswerColumn(
        "onboard_tilt_rms_deg", "number", "the same of roll or pitch, the larger", _onboard_rms("roll", "pitch")
    ),
    AnswerColumn(
        "onboard_velocity_rms_mps",
        "number",
        "the same of horizontal velocity",
        _onboard_rms("horizontal velocity"),
        False,
    ),
    AnswerColumn(
        "onboard_position_rms_m",
        "number",
        "the same of horizontal position",
        _onboard_rms("horizontal position"),
        False,
    ),
    AnswerColumn("gnss_latency_imu_s", "number", "delay of GNSS positions behind the inertial unit", _seen(LATENCY)),
    AnswerColumn(
        "gnss_velocity_lag_s", "number", "delay of GNSS velocities behind its positions", _seen(VELOCITY_LAG), False
    ),
    AnswerColumn(
        "antenna_forward_m", "number", "antenna forward of the inertial unit, where turns show it", _seen(ARM[0])
    ),
    AnswerColumn("antenna_right_m", "number", "the same to the right", _seen(ARM[1])),
    AnswerColumn("antenna_down_m", "number", "the same downwards", _seen(ARM[2])),
    AnswerColumn(
        "outage_60s_rms_m",
        "number",
        "largest horizontal error in replayed outages of 60 s, smoothed, RMS over the outages",
        _outage_m,
    ),
)
