"""Chapter of the forecast: conclusions that follow from the numbers, and judgement from enough starts only."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from groundstation.chapters.parts import Section
from groundstation.results.flight import NotAssessable
from groundstation.systems.inertial.forecast_answer import SkillRow
from groundstation.systems.inertial.forecast_chapter import forecast
from tests.report_example import example
from tests.section_contents import every_text, grid, notes, row, rows, titles, tones
from tests.systems.inertial.example import forecast_result, inertial_result
from tests.told import missing_in

SKILL = "Skill by method and horizon"
HONEST = "Is the claimed σ honest? Drift windows"


def chapter(**changes: Any) -> Section:
    """The chapter of the example, with some fields of its answer changed."""
    section = forecast(example(inertial_result(), forecast_result(**changes)))
    assert section is not None
    return section


def changed_skill(change: Callable[[SkillRow], SkillRow]) -> dict[str, Any]:
    return {"skill": tuple(change(row) for row in forecast_result().skill)}


def with_coverage(share: float) -> dict[str, Any]:
    """Every band held that share."""
    return changed_skill(lambda row: row if row.coverage95 is None else replace(row, coverage95=share))


def times(method: str, factors: dict[float, float]) -> Callable[[SkillRow], SkillRow]:
    """Errors of a method multiplied, by horizon."""
    return lambda row: (
        replace(row, rms_m=row.rms_m * factors[row.horizon_min])
        if row.method == method and row.horizon_min in factors
        else row
    )


def test_everything_has_its_place() -> None:
    section = chapter()
    assert section.headline == "Shipped method: windows of the drift alone"
    assert titles(section) == [
        *("forecast.growth", SKILL, "forecast.calibration", "forecast.hindcast_map", "Gaps with GNSS on both sides"),
        *("The shipped method in detail", HONEST, "Is the claimed σ honest? Windows", "Outages by phase of flight"),
        "Coupled model",
    ]
    assert grid(section, SKILL).numbers == ("forecast_growth",)


def test_skill_is_told_against_the_raw_ins() -> None:
    section = chapter()
    figures = ("60 min", "windows of the drift alone", "RMS 483 m and 1790 m", "by the raw INS", "31 starts")
    assert not missing_in(notes(section)[0], *figures, "at every horizon")
    assert tones(section)[0] == "good"
    assert row(section, SKILL, "windows of the drift alone (shipped)")[0] == "✓ 24"
    assert row(section, SKILL, "Starts") == ("43", "42", "41", "37", "31", "25", "19")


def test_a_method_worse_than_the_raw_ins_is_not_praised() -> None:
    section = chapter(**changed_skill(times("drift_windows", {60.0: 10.0, 90.0: 10.0})))
    assert "beats the raw INS at 1, 5, 10, 30 and 120 min." in notes(section)[0]
    assert tones(section)[0] == "warn"


def test_best_of_the_flight_is_marked_whoever_it_is() -> None:
    section = chapter(best_method={"90": "raw_ins"})
    assert row(section, SKILL, "raw INS, no correction") == ("90", "430", "840", "2110", "1790", "✓ 1210", "2710")
    assert row(section, SKILL, "windows of the drift alone (shipped)")[0] == "24"


def test_the_shipped_method_is_told_in_detail() -> None:
    cells = row(chapter(), "The shipped method in detail", "60 min")
    assert cells == ("31", "483", "338", "918", "94%", "71%")


@pytest.mark.parametrize(
    ("independent", "nees", "verdict"),
    [
        *((5, 1.0, "✓ within limits"), (5, 9.0, "▲ too sure"), (5, 0.1, "○ modest")),
        *((4, 1.0, "○ too few to judge"), (1, 9.0, "○ too few to judge")),
    ],
)
def test_calibration_is_judged_from_enough_starts_only(independent: int, nees: float, verdict: str) -> None:
    section = chapter(
        calibration=tuple(
            replace(row, independent_starts=independent, nees=nees) for row in forecast_result().calibration
        )
    )
    cells = row(section, HONEST, "60 min")
    assert cells[1] == str(independent)
    assert cells[-4:] == (f"{nees:.2f}", "0.60 … 1.50", "1.80", verdict)
    judged = "At 10, 30, 60, 90 and 120 min not judged: fewer than 5 independent starts."
    assert notes(section)[1].endswith(judged) == (independent < 5)


def test_horizons_not_judged_are_not_among_every_horizon() -> None:
    calibration = tuple(
        replace(row, independent_starts=6 if row.horizon_min < 60.0 else 2) for row in forecast_result().calibration
    )
    told = notes(chapter(calibration=calibration, **with_coverage(1.0)))[1]
    assert "wider than needed at 1, 5, 10 and 30 min. At 60, 90 and 120 min not judged" in told


def test_nothing_is_called_honest_from_too_few_starts() -> None:
    calibration = tuple(
        replace(forecast_result().calibration[0], horizon_min=float(minutes), independent_starts=1)
        for minutes in (1, 5, 10, 30, 60, 90, 120)
    )
    section = chapter(calibration=calibration)
    assert notes(section)[1] == "Its σ cannot be judged: fewer than 5 independent starts."
    assert tones(section)[1] == "unknown"
    assert not [note for note in notes(section) if "honest on this flight" in note]


@pytest.mark.parametrize(
    ("share", "tone", "verdict"),
    [
        (0.94, "good", "held 94% of the errors: the σ it claims is honest on this flight."),
        (0.7, "warn", "held 70% of the errors: too narrow at every horizon."),
        (1.0, "plain", "held 100% of the errors: wider than needed at every horizon."),
    ],
)
def test_conclusion_on_the_band_follows_its_coverage(share: float, tone: str, verdict: str) -> None:
    section = chapter(**with_coverage(share))
    assert notes(section)[1].endswith(verdict)
    assert tones(section)[1] == tone


def test_a_forecast_that_is_not_calibrated_says_why() -> None:
    section = chapter(is_calibrated=False, calibration_reason="40 min before the first outage, a Schuler period is 84")
    start = "Not calibrated: 40 min before the first outage, a Schuler period is 84. The 95 % band"
    assert notes(section)[1].startswith(start)
    assert tones(section)[1] == "warn"


@pytest.mark.parametrize(
    ("factors", "sentence"),
    [
        (
            {},
            "windows of Neusypin 2003 help at every horizon (at 120 min 813 m against 921 m of the separate",
        ),
        ({10.0: 2.0, 30.0: 2.0}, "windows of Neusypin 2003 help at 1, 5, 60, 90 and 120 min"),
        (
            {10.0: 2.0, 30.0: 2.0},
            "and hurt at 10 and 30 min (at 30 min 1266 m against 717 m of the separate",
        ),
        (
            dict.fromkeys((1.0, 5.0, 10.0, 30.0, 60.0, 90.0, 120.0), 0.34 / 0.30),
            "windows of Neusypin 2003 change nothing",
        ),
    ],
)
def test_windows_help_where_the_numbers_say_so(factors: dict[float, float], sentence: str) -> None:
    told = notes(chapter(**changed_skill(times("windows", factors))))[2]
    assert sentence in told
    assert told.endswith("One flight decides nothing: starts overlap.")


def test_windows_are_held_against_the_model_that_they_are_of() -> None:
    """The last estimate that is forecast may be that of the coupled model, with half the error."""
    half = {row.horizon_min: 0.5 for row in forecast_result().coupled}
    better = tuple(replace(row, rms_m=0.5 * row.rms_m, gain=0.51) for row in forecast_result().coupled)
    told = notes(chapter(coupled=better, **changed_skill(times("last_estimate", half))))[2]
    assert "windows of Neusypin 2003 help at every horizon (at 120 min 813 m against 921 m" in told


def test_captions_say_which_starts_and_how_many_states() -> None:
    section = chapter()
    caption = grid(section, "Outages by phase of flight").caption
    assert "the starts of the skill table, hence the same numbers. Before it: every 60 s from 10 min" in caption
    assert grid(section, "Coupled model").caption.startswith("Sixteen states")
    assert grid(section, SKILL).caption.replace("\u202f", " ").startswith("Starts every 300 s from flight time 1:20:00")


def test_rows_of_the_smaller_tables() -> None:
    section = chapter()
    assert row(section, "Gaps with GNSS on both sides", "30 min") == ("30", "419", "34", "95%", "95%")
    assert rows(section, "Outages by phase of flight")[-1] == ("taxi, before 1:20:00", "1:00", "4", "12.0", "30.0")
    assert row(section, "Coupled model", "60 min") == ("596", "+2%")


def test_a_reason_stands_in_place_of_the_answer() -> None:
    section = forecast(example(None, not_assessable=(NotAssessable("forecast", "the log is too short"),)))
    assert section is not None
    assert notes(section) == ["Not assessable: the log is too short"]


def test_without_answer_and_reason_there_is_no_chapter() -> None:
    assert forecast(example(None)) is None


def test_empty_tables_leave_the_figures_alone() -> None:
    empty: dict[str, Any] = dict.fromkeys(("skill", "gaps", "phases", "classic_starts", "calibration", "coupled"), ())
    section = chapter(**empty)
    assert titles(section) == ["forecast.growth", "forecast.calibration", "forecast.hindcast_map"]
    assert notes(section) == []


def test_what_is_not_known_is_a_dash() -> None:
    calibration = tuple(replace(row, nees=float("nan")) for row in forecast_result().calibration)
    skill = changed_skill(lambda row: replace(row, median_m=float("nan"), coverage95=None, coverage95_model=None))
    section = chapter(calibration=calibration, **skill)
    assert row(section, HONEST, "60 min")[-4:] == ("—", "0.60 … 1.50", "1.80", "")
    assert row(section, "The shipped method in detail", "60 min")[2:] == ("—", "918", "—", "—")
    assert not [text for text in every_text(section) if "nan" in text.lower().split() or "None" in text]
