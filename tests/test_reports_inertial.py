"""Chapters of system 2 in the report: conclusions that follow from the numbers, and a page whatever is missing."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.results.forecast import ForecastResult, SkillRow
from groundstation.results.inertial import AzimuthEstimate, ChannelResult, InertialResult, RealOutage
from tests.inertial_example import forecast_result, inertial_result
from tests.report_example import example
from tests.test_reports import HOSTILE, Page, report

LARGEST_REPORT_BYTES = 2_500_000
FIGURES = ("Position error of the INS", "Velocity error of the INS", "Platform tilt and gyro drift", "Innovations")
MORE = ("Track error before and after", "Observability", "How the error grows", "Calibration", "Hindcast map")


def flight(inertial: InertialResult | None = None, forecast: ForecastResult | None = None) -> FlightResults:
    """The report's example without a heading, with the answers of system 2."""
    answers = [answer for answer in (inertial, forecast) if answer is not None]
    results = example(inertial, forecast)
    figures = tuple(figure for answer in answers for figure in answer.figures)
    return replace(results, figures=(*results.figures, *figures))


def text_of(folder: Path, inertial: dict[str, Any] | None = None, forecast: dict[str, Any] | None = None) -> str:
    """Text of a report whose answers of system 2 differ from the example's by some fields."""
    results = flight(inertial_result(**(inertial or {})), forecast_result(**(forecast or {})))
    return Page(report(folder, results)).text.replace("\u202f", " ")


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> str:
    return report(tmp_path_factory.mktemp("full"), flight(inertial_result(), forecast_result()))


def test_both_chapters_stand_whole_and_small_enough(full: str) -> None:
    page = Page(full)
    assert len(full.encode()) < LARGEST_REPORT_BYTES
    for title in (*FIGURES, *MORE, "The paper's four starts", "Gaps with GNSS on both sides", "Coupled model"):
        assert title in page.text, title
    assert "nan" not in page.text.lower().split() and "None" not in page.text
    links = {value for tag, name, value in page.attributes if tag == "a" and name == "href"}
    assert {f"tables/{name}.csv" for name in ("inertial_states", "forecast_map", "forecast_classic")} <= links


def test_figures_asked_first_stand_first(full: str) -> None:
    text = Page(full).text.replace("\u202f", " ")
    front = text[: text.index("1 Heading correction")]
    assert "0.41 nmi/h" in front and "483 m" in front and "raw INS 1790 m" in front
    assert "An unaided INS of 0.41 nmi/h (median; 95 % of the time below 1.32 nmi/h)" in text
    assert (
        "95.3% (north) and 95.3% (east) of the innovations lie inside their 95 % band: the filter is consistent" in text
    )


def test_states_stand_with_sigma_and_observability(full: str) -> None:
    text = Page(full).text.replace("\u202f", " ")
    assert "Platform tilt, arcsec +11.2 1.5 0.81 10:00" in text
    assert "Random gyro drift, °/h +0.0021 0.0040 0.08 never" in text
    assert "2:40:00 – 3:01:20 GNSS 21:20 212 m 260 m ✓ within 2 σ" in text and "○ GNSS did not return" in text


@pytest.mark.parametrize(
    ("missing", "left", "returned"),
    [
        ("gnss", "GNSS", "GNSS did not return"),
        ("ins", "INS", "INS did not return"),
        ("both", "both", "neither returned"),
    ],
)
def test_an_outage_says_what_was_missing(tmp_path: Path, missing: str, left: str, returned: str) -> None:
    outages = (RealOutage(60.0, 120.0, 60.0, 5.0, 9.0, missing), RealOutage(600.0, 660.0, 60.0, None, None, missing))
    text = text_of(tmp_path, {"outages": outages})
    assert f"1:00 – 2:00 {left} 1:00 5 m 9 m ✓ within 2 σ" in text and f"○ {returned}" in text


def changed_states(name: str, **changes: float) -> dict[str, Any]:
    """Both channels with one state changed."""
    north, east = (
        replace(
            channel,
            states=tuple(replace(state, **changes) if state.name == name else state for state in channel.states),
        )
        for channel in inertial_result().channels
    )
    return {"north": north, "east": east, "settings": {"noise.drift_rate_dphph": 5e-6}}


def test_a_state_the_class_leaves_out_has_no_number(tmp_path: Path) -> None:
    alone = changed_states("drift_rate", value=0.0, sigma=5e-6, observability=3e-6)
    assert "Drift rate, °/h² (not estimated in this class) — — — — — — — —" in text_of(tmp_path, alone)
    text = text_of(tmp_path, alone | {"east": inertial_result().east})
    assert "Drift rate, °/h² (north not estimated in this class) — — — — +0.0029" in text


@pytest.mark.parametrize(("sigma", "observability"), [(5e-6, 0.2), (4e-3, 3e-6)], ids=["seen", "grown"])
def test_a_state_that_was_seen_or_has_grown_keeps_its_number(
    tmp_path: Path, sigma: float, observability: float
) -> None:
    text = text_of(tmp_path, changed_states("drift_rate", sigma=sigma, observability=observability))
    assert "Drift rate, °/h² +0.0029" in text and "(not estimated" not in text


def test_an_ins_of_unknown_kind_is_not_called_unaided(tmp_path: Path) -> None:
    text = text_of(tmp_path, {"kind": "unknown", "kind_reason": "it stood still all the time."})
    assert "Whether GNSS corrects this INS already cannot be told: it stood still all the time. If it does" in text
    assert "An INS of 0.41 nmi/h (median; 95 % of the time below 1.32 nmi/h), taken as unaided:" in text
    assert "if it does, what follows says nothing of a forecast" in text and "An unaided INS" not in text
    assert "INS drift" not in text[: text.index("1 Heading correction")]


def test_reopening_and_other_ins_are_told(tmp_path: Path) -> None:
    text = text_of(tmp_path, {"reopened": 2, "other_ins": ("ins.1", "ins.2")})
    assert "the filter was opened to it again, 2 times: the noise of INS class navigation does not fit" in text
    assert "not used: ins.1, ins.2" in text
    assert "was opened to it again" not in text_of(tmp_path)


def test_units_of_the_settings_are_read_from_their_names(tmp_path: Path) -> None:
    settings = {
        "noise.velocity_walk_mps_per_sqrt_s": 0.004,
        "noise.tilt_walk_deg_per_sqrt_h": 0.0044,
        "noise.drift_walk_dph_per_sqrt_h": 0.5,
        "noise.drift_rate_walk_dphph_per_sqrt_h": 0.25,
        "noise.tilt_rad": 0.0002,
    }
    text = text_of(tmp_path, {"settings": settings})
    for told in ("velocity walk 0.004 m/s/√s", "tilt walk 0.0044 °/√h", "drift walk 0.5 °/h/√h", "tilt 0.0002 rad"):
        assert f"noise.{told}" in text
    assert "noise.drift rate walk 0.25 °/h²/√h" in text and "sqrt" not in text


@pytest.mark.parametrize(
    ("independent", "nees", "verdict"),
    [
        *((5, 1.0, "✓ within limits"), (5, 9.0, "▲ too sure"), (5, 0.1, "○ modest")),
        *((4, 1.0, "○ too few to judge"), (1, 9.0, "○ too few to judge")),
    ],
)
def test_calibration_is_judged_from_enough_starts_only(
    tmp_path: Path, independent: int, nees: float, verdict: str
) -> None:
    rows = tuple(replace(row, independent_starts=independent, nees=nees) for row in forecast_result().calibration)
    text = text_of(tmp_path, forecast={"calibration": rows})
    table = text[text.index("Is the claimed σ honest? Drift windows") :]
    assert f"{nees:.2f} 0.60 … 1.50 1.80 {verdict}" in table
    judged = "At 10, 30, 60, 90 and 120 min too few to judge: fewer than 5 independent starts."
    assert (judged in text) == (independent < 5)


def test_horizons_not_judged_are_not_among_every_horizon(tmp_path: Path) -> None:
    rows = tuple(
        replace(row, independent_starts=6 if row.horizon_min < 60.0 else 2) for row in forecast_result().calibration
    )
    change = changed_skill(lambda row: row if row.coverage95 is None else replace(row, coverage95=1.0))
    text = text_of(tmp_path, forecast=change | {"calibration": rows})
    assert "wider than needed at 1, 5, 10 and 30 min. At 60, 90 and 120 min too few to judge" in text


def test_nothing_is_called_honest_from_too_few_starts(tmp_path: Path) -> None:
    rows = tuple(
        replace(forecast_result().calibration[0], horizon_min=float(minutes), independent_starts=1)
        for minutes in (1, 5, 10, 30, 60, 90, 120)
    )
    text = text_of(tmp_path, forecast={"calibration": rows})
    assert "Whether its σ is honest cannot be judged: fewer than 5 independent starts." in text
    assert "honest on this flight" not in text


def test_captions_say_which_starts_and_how_many_states(full: str) -> None:
    text = Page(full).text
    assert "These starts are not those of the table of skill: they come every 60 s from 10 min" in text
    assert "Fourteen states" in text


def test_an_aided_ins_is_told_at_once_and_its_forecast_not_praised(tmp_path: Path) -> None:
    text = text_of(tmp_path, {"kind": "gnss_aided", "kind_reason": "its error stays below 2 m for an hour"})
    assert "aided by GNSS, and a forecast from it means nothing: its error stays below 2 m for an hour." in text
    assert "nothing about a forecast" in text
    assert "honest on this flight" not in text and "beats the raw INS" not in text
    assert "INS drift" not in text[: text.index("1 Heading correction")]


def with_share(share: float, *, raised: bool) -> dict[str, Any]:
    """A pair of channels with a share of innovations inside their band."""

    def changed(channel: ChannelResult) -> ChannelResult:
        limits = (None, None) if raised else (channel.nis_low, channel.nis_high)
        return replace(channel, share_inside95=share, nis_low=limits[0], nis_high=limits[1])

    return {channel.name: changed(channel) for channel in inertial_result().channels}


@pytest.mark.parametrize(
    ("share", "raised", "verdict"),
    [
        (0.95, False, "the filter is consistent"),
        (0.80, False, "the filter is surer than it should be"),
        (0.80, True, "the filter is surer than it should be"),
        (0.995, False, "the filter claims less than it knows"),
        (0.995, True, "innovations cannot show whether the filter is consistent"),
        (1.0, True, "innovations cannot show whether the filter is consistent"),
    ],
)
def test_conclusion_on_the_filter_follows_its_innovations(
    tmp_path: Path, share: float, raised: bool, verdict: str
) -> None:
    text = text_of(tmp_path, with_share(share, raised=raised))
    assert verdict in text
    assert ("of the innovations lie inside" in text) == (not raised or share < 0.93)


def changed_skill(change: Callable[[SkillRow], SkillRow]) -> dict[str, Any]:
    return {"skill": tuple(change(row) for row in forecast_result().skill)}


def times(method: str, factors: dict[float, float]) -> Callable[[SkillRow], SkillRow]:
    """Errors of a method multiplied, by horizon."""
    return lambda row: (
        replace(row, rms_m=row.rms_m * factors[row.horizon_min])
        if row.method == method and row.horizon_min in factors
        else row
    )


@pytest.mark.parametrize(
    ("factors", "sentence"),
    [
        ({}, "windows help at every horizon (at 120 min 813 m against 921 m of the last estimate)"),
        ({10.0: 2.0, 30.0: 2.0}, "windows help at 1, 5, 60, 90 and 120 min"),
        ({10.0: 2.0, 30.0: 2.0}, "and hurt at 10 and 30 min (at 30 min 1266 m against 717 m of the last estimate)"),
        (dict.fromkeys((1.0, 5.0, 10.0, 30.0, 60.0, 90.0, 120.0), 0.34 / 0.30), "windows change nothing"),
    ],
)
def test_windows_help_where_the_numbers_say_so(tmp_path: Path, factors: dict[float, float], sentence: str) -> None:
    assert sentence in text_of(tmp_path, forecast=changed_skill(times("windows", factors)))


@pytest.mark.parametrize(
    ("share", "verdict"),
    [(0.94, "is honest on this flight"), (0.7, "too narrow at every horizon"), (1.0, "wider than needed at every")],
)
def test_conclusion_on_the_band_follows_its_coverage(tmp_path: Path, share: float, verdict: str) -> None:
    change = changed_skill(lambda row: row if row.coverage95 is None else replace(row, coverage95=share))
    assert verdict in text_of(tmp_path, forecast=change)


def test_a_forecast_that_is_not_calibrated_says_why(tmp_path: Path) -> None:
    change = {"is_calibrated": False, "calibration_reason": "40 min before the first outage, a Schuler period is 84"}
    assert "Not calibrated: 40 min before the first outage, a Schuler period is 84." in text_of(
        tmp_path, forecast=change
    )


def test_a_method_worse_than_the_raw_ins_is_not_praised(tmp_path: Path) -> None:
    text = text_of(tmp_path, forecast=changed_skill(times("drift_windows", {60.0: 10.0, 90.0: 10.0})))
    assert "beats the raw INS at 1, 5, 10, 30 and 120 min" in text


def test_best_of_the_flight_is_marked_whoever_it_is(tmp_path: Path) -> None:
    text = text_of(tmp_path, forecast={"best_method": {"90": "raw_ins"}})
    assert "raw INS, no correction 90 430 840 2110 1790 ✓ 1210 2710" in text


def test_azimuth_that_turns_do_not_show_has_no_number(tmp_path: Path) -> None:
    azimuth = AzimuthEstimate(False, None, 0.4, 1, 20.0, "one turn is too little")
    text = text_of(tmp_path, {"azimuth": azimuth})
    assert "Azimuth error: not observable on this flight: one turn is too little." in text


def test_reasons_stand_in_place_of_results(tmp_path: Path) -> None:
    reasons = (NotAssessable("inertial", "GNSS for a minute only"), NotAssessable("forecast", "the log is too short"))
    text = Page(report(tmp_path, example(None, not_assessable=reasons))).text
    assert "Not assessable: GNSS for a minute only" in text and "Not assessable: the log is too short" in text


def test_without_results_and_reasons_there_are_no_chapters(tmp_path: Path) -> None:
    text = Page(report(tmp_path, example(None))).text
    assert "INS errors" not in text and "Forecast without GNSS" not in text


TIMES = ("time_s", "start_s", "horizon_min")


def _figures(results: FlightResults, change: Callable[[np.ndarray], np.ndarray]) -> FlightResults:
    figures = tuple(
        FigureData(
            item.name, {name: _changed(name, values, change) for name, values in item.columns.items()}, item.digits
        )
        for item in results.figures
    )
    return replace(results, figures=figures)


def _changed(name: str, values: np.ndarray, change: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Times stay what they are, unless rows go; so do texts and flags."""
    new = change(values) if values.dtype.kind == "f" or len(change(values)) < len(values) else values
    return values if name.endswith(TIMES) and len(new) == len(values) else new


CHANGES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "one row": lambda values: values[:1],
    "no row": lambda values: values[:0],
    "nan": lambda values: np.full(len(values), np.nan) if values.dtype.kind == "f" else values,
    "absurd": lambda values: (
        np.where(np.arange(len(values)) % 7 == 3, 1e9, values) if values.dtype.kind == "f" else values
    ),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_report_is_written_whatever_the_figures_lack(
    tmp_path: Path, change: Callable[[np.ndarray], np.ndarray]
) -> None:
    page = Page(report(tmp_path, _figures(flight(inertial_result(), forecast_result()), change)))
    assert "States" in page.text and "Skill by method and horizon" in page.text


def test_each_figure_alone_and_the_time_alone_make_a_report(tmp_path: Path) -> None:
    results = flight(inertial_result(), forecast_result())
    for item in (*inertial_result().figures, *forecast_result().figures):
        first = FigureData(item.name, dict(list(item.columns.items())[:1]), {})
        for figure in (item, first):
            Page(report(tmp_path, replace(results, figures=(figure,))))


def test_empty_tables_and_unknown_numbers_make_a_report(tmp_path: Path) -> None:
    unknown = float("nan")
    bare = {"outages": (), "azimuth": None, "settings": {}, "figures": (), "largest_radial_error_m": None}
    rates = {"radial_error_rate_50_nmiph": None, "radial_error_rate_95_nmiph": unknown, "velocity_error_rms_mps": None}
    empty: dict[str, Any] = dict.fromkeys(("skill", "gaps", "phases", "classic_starts", "calibration", "coupled"), ())
    channels = {channel.name: replace(channel, states=()) for channel in inertial_result().channels}
    text = text_of(tmp_path, bare | rates | channels, empty | {"figures": ()})
    assert "nan" not in text.lower().split() and "None" not in text


def test_texts_of_the_estimator_are_escaped(tmp_path: Path) -> None:
    inertial = inertial_result(ins_topic=HOSTILE, kind_reason=HOSTILE, ins_class=HOSTILE, settings={HOSTILE: HOSTILE})
    page = Page(report(tmp_path, flight(inertial, forecast_result(calibration_reason=HOSTILE, is_calibrated=False))))
    assert "script" not in page.tags and "img" not in page.tags
