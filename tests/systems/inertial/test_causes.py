"""Errors of an INS by cause: constants that are known are found, what cannot be told is said, every interval holds."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.pipeline.one_flight.analyse import known_of, run_analyses, seen_by_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.systems.inertial.analysis import CAUSES, INERTIAL
from groundstation.systems.inertial.cause_answer import CAUSES as CAUSE_NAMES
from groundstation.systems.inertial.cause_answer import CauseShare, CausesResult, Within95
from groundstation.systems.inertial.cause_arrays import CausesOverTime
from groundstation.systems.inertial.cause_chapter import causes as chapter
from groundstation.systems.inertial.cause_fit import fit_causes
from groundstation.systems.inertial.cause_legs import straight_legs
from groundstation.systems.inertial.cause_plots import along, velocity
from groundstation.systems.inertial.causes import _sentence, assess_causes, error_windows
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.study.causes import coverage_table, study_causes, widths_table
from groundstation.systems.inertial.study.causes_runs import CASES, CauseCell, CauseOutcome, judge_causes
from groundstation.tables.table import Flight
from tests.report_example import example
from tests.section_contents import notes, rows
from tests.systems.inertial.causes_example import (
    BIAS_UG,
    DRIFT_DPH,
    SECONDS,
    TILT_ARCSEC,
    causes,
    compared,
    errors,
    filtered,
    route,
)
from tests.systems.inertial.flights import batch_of, flight_of

ORDINARY = Configuration()
NOISE_M = 1e-3  # of a receiver that shows what the model leaves out
MODEL_SHARE = 0.02  # of a response: means over ten seconds in turns, vertical motion


def of(differences: InsDifferences) -> CausesResult:
    return assess_causes(differences, filtered(differences), 0.0)


def without_velocity(differences: InsDifferences) -> InsDifferences:
    epochs = differences.epochs
    return replace(differences, epochs=replace(epochs, velocity_mps=np.full_like(epochs.velocity_mps, np.nan)))


def test_known_constants_are_inside_their_intervals() -> None:
    answer = causes()
    for name, true in (
        ("accelerometer_right", BIAS_UG),
        ("accelerometer_forward", 0.0),
        ("gyro_forward", DRIFT_DPH),
        ("gyro_right", 0.0),
        ("azimuth", 0.0),
    ):
        found = answer.parameter(name)  # type: ignore[arg-type]
        assert found is not None
        assert abs(found.value - true) < found.half95, name
    bias = answer.parameter("accelerometer_right")
    assert bias is not None and bias.is_observable and bias.half95 < 0.8 * BIAS_UG


@pytest.mark.parametrize(
    ("cause", "flown", "made"),
    [
        ("schuler", "racetrack", {"tilt_arcsec": TILT_ARCSEC}),
        ("body", "racetrack", {"bias_ug": BIAS_UG}),
        ("drift", "straight", {"drift_dph": 0.015}),
    ],
)
def test_the_cause_of_an_error_has_the_largest_share(cause: str, flown: str, made: dict[str, float]) -> None:
    answer = of(compared(route(flown), errors(route(flown), **made), noise=0.1))
    share = max(answer.shares, key=lambda one: one.share.value)
    assert share.name == cause, answer.sentence
    assert sum(one.share.value for one in answer.shares) == pytest.approx(1.0)


def test_a_tilt_alone_gives_its_schuler_amplitude() -> None:
    answer = of(compared(route(), errors(route(), tilt_arcsec=TILT_ARCSEC), noise=0.1))
    assert answer.start_tilt_arcsec.low95 < TILT_ARCSEC < answer.start_tilt_arcsec.high95
    north = answer.schuler[0]
    assert north.amplitude_mps.low95 < 9.8 * np.deg2rad(TILT_ARCSEC / 3600.0) / 1.24e-3 < north.amplitude_mps.high95
    assert north.phase_deg is not None  # tilt positive: the velocity error falls first
    assert north.phase_deg.low95 < -90.0 < north.phase_deg.high95


def test_columns_are_the_responses_of_the_simulation() -> None:
    made = errors(route(), bias_ug=BIAS_UG)
    differences = compared(route(), made)
    fit = fit_causes(differences, filtered(differences))
    parts = sum(fit.parts().values())
    true = np.zeros(len(fit.value))
    true[11] = BIAS_UG * 9.80665e-6
    at = np.round(fit.time_s).astype(int)
    error = made.velocity_mps[0, np.minimum(at, SECONDS - 1)]
    assert np.abs(parts @ true - error).max() < MODEL_SHARE * np.abs(error).max()


def test_one_heading_cannot_part_body_from_earth() -> None:
    flown = route("straight", 3600)
    after = slice(1200, None)
    whole = compared(flown, errors(flown, bias_ug=BIAS_UG), noise=2.0)
    epochs = type(whole.epochs)(*(getattr(whole.epochs, name)[after] for name in whole.epochs.__dataclass_fields__))
    columns = {
        name: getattr(whole, name)[after]
        for name in ("latitude_deg", "longitude_deg", "altitude_m", "velocity_mps", "heading_deg")
    }
    answer = of(replace(whole, epochs=epochs, **columns))
    assert not answer.is_parted
    section = chapter(example(answer))
    assert section is not None
    assert any("nearly one heading" in line for line in notes(section))
    bias = answer.parameter("accelerometer_right")
    assert bias is not None and not bias.is_observable
    assert abs(answer.share("body").value) < MODEL_SHARE  # nothing turned: it counts as a tilt


def test_legs_and_errors_along_the_track() -> None:
    differences = compared(route(), errors(route()))
    legs = causes().legs
    assert len(legs) > 3
    assert all(one.end_s - one.start_s >= 180.0 for one in legs)
    eastward = np.zeros((SECONDS, 2))
    eastward[:, 1] = differences.epochs.time_s  # 1 m/s east
    found, _left_out = straight_legs(differences, eastward, np.zeros((SECONDS, 2)))
    for leg in found:
        assert leg.along_rate_nmiph is not None and leg.across_rate_nmiph is not None
        course = np.deg2rad(leg.course_deg)
        assert leg.along_rate_nmiph.value == pytest.approx(np.sin(course) * 3600 / 1852, rel=0.02, abs=0.02)
        assert leg.across_rate_nmiph.value == pytest.approx(np.cos(course) * 3600 / 1852, rel=0.02, abs=0.02)
        assert leg.along_change_mps is not None and leg.along_change_mps.value == 0.0


def test_windows_of_an_error_that_grows_evenly() -> None:
    differences = compared(route(), errors(route()))
    run = filtered(differences)
    grown = np.zeros((SECONDS, 2))
    grown[:, 0] = 0.1 * differences.epochs.time_s
    (half, hour) = error_windows(run, grown, 600.0)
    assert (half.hours, hour.hours) == (0.5, 1.0)
    assert half.median_m == pytest.approx(180.0)
    assert half.since_start_m == pytest.approx(240.0)  # 0.5 h after 600 s
    assert half.independent == 2
    assert error_windows(run, grown, None)[0].since_start_m is None
    assert error_windows(run, np.full((SECONDS, 2), np.nan), None) == ()


def test_a_reset_is_a_cause_of_its_own() -> None:
    differences = compared(route(), errors(route(), tilt_arcsec=5.0), noise=1.0)
    epochs = differences.epochs
    after = np.arange(SECONDS) >= 3000
    jumped = replace(
        epochs,
        position_m=epochs.position_m + 500.0 * after[:, None],
        velocity_mps=epochs.velocity_mps + 2.0 * after[:, None] * np.cos((epochs.time_s - 3000.0) * 1.24e-3)[:, None],
        is_reset=np.arange(SECONDS) == 3000,
    )
    answer = of(replace(differences, epochs=jumped))
    assert answer.resets == 1
    assert answer.share("reset").value > 0.5, answer.sentence


@pytest.mark.parametrize("seconds", [600, 1500])
def test_a_short_flight_has_wide_intervals_and_no_traceback(seconds: int) -> None:
    flown = route("racetrack", seconds)
    answer = of(compared(flown, errors(flown, tilt_arcsec=TILT_ARCSEC), noise=2.0))
    assert answer.windows == () if seconds == 600 else True
    assert answer.start_tilt_arcsec.low95 < TILT_ARCSEC < answer.start_tilt_arcsec.high95
    assert chapter(example(answer)) is not None


def test_what_cannot_be_told_has_a_reason() -> None:
    differences = compared(route(), errors(route(), tilt_arcsec=5.0), noise=1.0)
    for changed, why in (
        (without_velocity(differences), "velocity"),
        (replace(differences, latitude_deg=differences.latitude_deg * 0 + 89.0), "pole"),
        (
            replace(differences, epochs=replace(differences.epochs, is_reset=np.arange(SECONDS) % 500 == 499)),
            "reset",
        ),
    ):
        with pytest.raises(NotAssessableError, match=why):
            assess_causes(changed, filtered(changed), 0.0)


def test_gaps_and_the_date_line_change_nothing() -> None:
    made = errors(route(), tilt_arcsec=TILT_ARCSEC)
    differences = compared(route(), made, noise=2.0)
    epochs = differences.epochs
    gone = (np.arange(SECONDS) % 7 == 0) | ((epochs.time_s > 2000) & (epochs.time_s < 2300))
    cut = replace(
        epochs,
        position_m=np.where(gone[:, None], np.nan, epochs.position_m),
        velocity_mps=np.where(gone[:, None], np.nan, epochs.velocity_mps),
    )
    across = (differences.longitude_deg - differences.longitude_deg[2000] + 360.0) % 360.0 - 180.0
    whole, holed = of(differences), of(replace(differences, epochs=cut, longitude_deg=across))
    assert holed.start_tilt_arcsec.low95 < TILT_ARCSEC < holed.start_tilt_arcsec.high95
    assert holed.start_tilt_arcsec.value == pytest.approx(whole.start_tilt_arcsec.value, abs=8.0)


def answer_of(flight: Flight) -> tuple[CausesResult | None, list[str]]:
    seen = seen_by_analyses(flight, ORDINARY)
    found = run_analyses((INERTIAL, CAUSES), seen, known_of(seen, ORDINARY))
    answer = found.answers.get(CAUSES.name)
    assert answer is None or isinstance(answer, CausesResult)
    return answer, [str(one.reason) for one in found.not_assessable if one.analysis == CAUSES.name]


def test_a_flight_of_tables_gives_the_answer_and_an_aided_ins_the_reason() -> None:
    flight = flight_of(batch_of(duration_s=2400.0), ins_kind="unaided")
    answer, reasons = answer_of(flight)
    assert answer is not None and not reasons
    assert {one.name for one in answer.shares} == set(CAUSE_NAMES)
    aided, why = answer_of(replace(flight, metadata={"ins_kind": "gnss_aided"}))
    assert aided is None
    assert any("GNSS corrects this INS already" in one for one in why)


def test_the_chapter_tells_every_table() -> None:
    results = example(causes())
    section = chapter(results)
    assert section is not None
    assert notes(section)[0].startswith(("Most", "Probably", "No cause"))
    assert len(rows(section, "What explains the error")) == len(CAUSE_NAMES) - 1  # no reset
    assert len(rows(section, "Schuler oscillation")) == 2
    assert len(rows(section, "Constants of the INS")) == 11
    assert len(rows(section, "Straight legs")) == len(causes().legs)
    assert len(rows(section, "Error by time")) == 2
    assert velocity(results) is not None and along(results) is not None
    data = results.rows_of(CausesOverTime)
    assert data is not None
    part = data.north
    total = part.schuler_mps + part.drift_mps + part.azimuth_mps + part.body_mps + part.reset_mps + part.unexplained_mps
    assert np.nanmax(np.abs(total - part.measured_mps)) < 1e-9


def test_a_share_above_the_whole_says_what_takes_the_rest_away() -> None:
    """Causes cancel: 103 % of the error is no misprint, and all shares still add up to one."""
    answer = causes()
    values = {"drift": 1.034, "azimuth": -0.05, "unexplained": 0.016}
    shares = tuple(
        CauseShare(one.name, Within95(share := values.get(one.name, 0.0), share - 0.05, share + 0.05))
        for one in answer.shares
    )
    assert sum(one.share.value for one in shares) == pytest.approx(1.0)
    told = _sentence(shares, (), answer.start_mps, answer.start_tilt_arcsec, None)
    assert told.startswith("Most of the velocity error, 103 % (98 to 108 %; the other causes take 3 % away), is")
    section = chapter(example(replace(answer, shares=shares, sentence=told)))
    assert section is not None and section.claim is not None
    for text in (section.headline, section.claim.remark):
        assert text.replace("\u202f", " ").endswith(", the other causes take 3 % away")
    told_percent = [float(str(row[1]).replace("\u2212", "-")) for row in rows(section, "What explains the error")]
    assert sum(told_percent) == pytest.approx(100.0, abs=2.0)
    whole = tuple(replace(one, share=Within95(float(one.name == "drift"), 0.9, 1.1)) for one in shares)
    assert "take" not in _sentence(whole, (), answer.start_mps, answer.start_tilt_arcsec, None)


def test_one_flight_of_a_cell_is_judged_and_counted() -> None:
    case = next(one for one in CASES if one.name == "racetrack")
    outcome = judge_causes(case, 70_050, 6, 0, duration_s=3600.0)
    told = {cell.quantity for cell in outcome.cells}
    assert {"azimuth", "share body", "amplitude at the end", "leg rate"} <= told
    assert np.mean([cell.is_inside for cell in outcome.cells]) > 0.8
    inside, outside = CauseCell("azimuth", 0.0, -1.0, 1.0), CauseCell("azimuth", 2.0, 1.0, 3.0)
    made = [CauseOutcome("racetrack", 0, "", (inside,)), CauseOutcome("warm-up", 0, "", (outside,))]
    table = coverage_table(made)
    assert table["all but broken"].tolist() == [1.0]
    assert table["warm-up"].tolist() == [0.0]
    assert widths_table(made)["half95_median"].tolist() == [1.0]


@pytest.mark.slow
def test_a_study_of_one_flight_a_cell_has_its_tables() -> None:
    study = study_causes(1, 5)
    assert {one.name for one in study.tables} == {"causes_coverage", "causes_widths"}
    assert all(case.name in study.tables[0].columns for case in CASES)
