"""Columns that autopilot health gives to the tables of flights."""

from collections.abc import Callable

from groundstation.results.columns import AnswerColumn
from groundstation.systems.health.answer import AutopilotHealth


def _worst(*quantities: str) -> Callable[[AutopilotHealth], float | None]:
    """Return the largest value in the air of some quantities."""

    def of(answer: AutopilotHealth) -> float | None:
        values = [one.worst for one in answer.measures if one.quantity in quantities and one.logged_share > 0.0]
        return max(values, default=None)

    return of


def _median(*quantities: str) -> Callable[[AutopilotHealth], float | None]:
    def of(answer: AutopilotHealth) -> float | None:
        values = [one.median for one in answer.measures if one.quantity in quantities and one.median is not None]
        return max(values, default=None)

    return of


def _limit(*quantities: str) -> Callable[[AutopilotHealth], float | None]:
    """Return the value from which the check of some quantities warns."""

    def of(answer: AutopilotHealth) -> float | None:
        values = [one.amber for one in answer.measures if one.quantity in quantities and one.amber is not None]
        return min(values, default=None)

    return of


def _least(quantity: str) -> Callable[[AutopilotHealth], float | None]:
    def of(answer: AutopilotHealth) -> float | None:
        values = [one.worst for one in answer.measures if one.quantity == quantity and one.logged_share > 0.0]
        return min(values, default=None)

    return of


COLUMNS: tuple[AnswerColumn[AutopilotHealth], ...] = (
    AnswerColumn("health_verdict", "category", "worst of the checks: pass, warn, fail", lambda one: one.verdict),
    AnswerColumn("health_sentence", "text", "autopilot health in a sentence", lambda one: one.sentence, False),
    AnswerColumn("autopilot", "category", "PX4 or ArduPilot", lambda one: one.autopilot),
    AnswerColumn(
        "health_vibration_mps2",
        "number",
        "vibration of the accelerometer, median in the air, of the worst IMU",
        _median("vibration_mps2", "accel_vibration_mps2"),
    ),
    AnswerColumn(
        "health_vibration_limit_mps2",
        "number",
        "vibration from which the check warns",
        _limit("vibration_mps2", "accel_vibration_mps2"),
        False,
    ),
    AnswerColumn("health_hdop", "number", "HDOP, median in the air", _median("hdop")),
    AnswerColumn("health_hdop_limit", "number", "HDOP from which the check warns", _limit("hdop"), False),
    AnswerColumn("health_test_ratio", "number", "largest innovation test ratio in the air", _worst("test_ratio")),
    AnswerColumn("health_battery_least", "number", "least left of the battery in the air", _least("battery_remaining")),
    AnswerColumn(
        "health_failed_checks",
        "count",
        "checks that fail",
        lambda answer: sum(one.verdict == "fail" for one in answer.checks),
    ),
)
