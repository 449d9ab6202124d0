"""Columns that approaches give to the tables of flights; the last landing counts."""

from collections.abc import Callable
from typing import TypeVar

from groundstation.results.columns import AnswerColumn
from groundstation.systems.landing.answer import (
    AlongError,
    Approach,
    Established,
    HeightError,
    LandingResult,
    PositionError,
)
from groundstation.systems.landing.touchdown_answer import Touchdown

Value = TypeVar("Value")


def _last(value: Callable[[Approach], Value | None]) -> Callable[[LandingResult], Value | None]:
    return lambda landing: value(landing.approaches[-1]) if landing.approaches else None


def _flown(value: Callable[[Established], float | None]) -> Callable[[LandingResult], float | None]:
    return _last(lambda one: None if one.established is None else value(one.established))


def _touchdown(value: Callable[[Touchdown], float | None]) -> Callable[[LandingResult], float | None]:
    return _last(lambda one: None if one.touchdown is None else value(one.touchdown))


def _measured(value: Callable[[PositionError], float | None]) -> Callable[[LandingResult], float | None]:
    """Make a column of the first topic whose error the localizer measured."""

    def of_approach(one: Approach) -> float | None:
        return next((value(error) for error in one.position_errors if error.state == "measured"), None)

    return _last(of_approach)


def _along(value: Callable[[AlongError], float | None]) -> Callable[[LandingResult], float | None]:
    """Make a column of the first topic whose error along the course the glide path measured."""

    def of_approach(one: Approach) -> float | None:
        return next((value(error) for error in one.along_errors if error.state == "measured"), None)

    return _last(of_approach)


def _height(value: Callable[[HeightError], float | None]) -> Callable[[LandingResult], float | None]:
    """Make a column of the first topic whose altitude the runway measured."""

    def of_approach(one: Approach) -> float | None:
        return next((value(error) for error in one.height_errors if error.state == "measured"), None)

    return _last(of_approach)


def _at_the_low_check(one: Approach) -> str:
    return min(one.stabilised, key=lambda row: row.height_m).verdict


def _criterion(name: str) -> Callable[[LandingResult], float | None]:
    """Make a column of the value of one criterion of the last approach."""
    return _last(lambda one: next((row.value for row in one.criteria if row.name == name), None))


def criteria_not_met(one: Approach) -> str:
    """Return the criteria that are not met, with their sides: "vertical_high bank_left"."""
    found = []
    for check in one.stabilised:
        sides = {place.name: place.side for place in check.places}
        failed = (gate.name for gate in check.gates if gate.state == "failed")
        found += ["_".join(filter(None, (name, sides.get(name, "")))) for name in failed]
    found += [row.name for row in one.criteria if row.state == "not met"]
    return " ".join(dict.fromkeys(found))


def _score(one: Approach) -> float | None:
    return one.score.share if one.score else None


COLUMNS: tuple[AnswerColumn[LandingResult], ...] = (
    AnswerColumn("landing_approaches", "count", "approaches found", lambda landing: len(landing.approaches)),
    AnswerColumn(
        "landing_go_arounds",
        "count",
        "of these, go-arounds",
        lambda landing: sum(one.outcome == "go-around" for one in landing.approaches),
    ),
    AnswerColumn(
        "landing_runway",
        "category",
        "airport and runway of the last approach, by the site file or the table of runways",
        _last(lambda one: one.runway.name or None),
    ),
    AnswerColumn(
        "landing_stabilised",
        "category",
        "the last approach from the lower check height down, by those criteria that the log has",
        _last(_at_the_low_check),
    ),
    AnswerColumn(
        "landing_criteria_not_met",
        "text",
        "criteria of the last approach that are not met, with their side",
        _last(criteria_not_met),
    ),
    AnswerColumn(
        "landing_unstable_approaches",
        "count",
        "approaches not stabilised from the lower check height down",
        lambda landing: sum(_at_the_low_check(one) == "not stabilised" for one in landing.approaches),
    ),
    AnswerColumn(
        "landing_touchdown_m",
        "number",
        "last touchdown behind the threshold, of INS positions less their error by the glide path",
        _criterion("touchdown"),
    ),
    AnswerColumn("landing_tailwind_mps", "number", "of the last approach, headwind negative", _criterion("tailwind")),
    AnswerColumn(
        "landing_score",
        "number",
        "by the user's own weights",
        _last(_score),
    ),
    AnswerColumn(
        "landing_lateral_rms_dots",
        "number",
        "deviation from the course of the last approach, RMS",
        _flown(lambda flown: flown.lateral_rms_dots),
    ),
    AnswerColumn(
        "landing_vertical_rms_dots",
        "number",
        "deviation from its glide path, RMS",
        _flown(lambda flown: flown.vertical_rms_dots),
    ),
    AnswerColumn(
        "landing_sink_rate_mps",
        "number",
        "onto the runway over the last second before the last touchdown",
        _touchdown(lambda one: one.sink_rate_mps),
    ),
    AnswerColumn("landing_peak_load_g", "number", "around it", _touchdown(lambda one: one.peak_load_g)),
    AnswerColumn(
        "landing_position_error_m",
        "number",
        "of the recorded positions across the course of the last approach, by the localizer, right positive",
        _measured(lambda error: error.error_m),
    ),
    AnswerColumn("landing_position_error_sigma_m", "number", "its sigma", _measured(lambda error: error.sigma_m)),
    AnswerColumn(
        "landing_along_error_m",
        "number",
        "of the recorded positions along the course of the last approach, by the glide path, forward positive",
        _along(lambda error: error.error_m),
    ),
    AnswerColumn("landing_along_error_sigma_m", "number", "its sigma", _along(lambda error: error.sigma_m)),
    AnswerColumn(
        "landing_height_error_m",
        "number",
        "of the recorded altitude on the roll-out of the last approach, by the elevation of the runway, upwards",
        _height(lambda error: error.error_m),
    ),
    AnswerColumn("landing_height_error_sigma_m", "number", "its sigma", _height(lambda error: error.sigma_m)),
)
