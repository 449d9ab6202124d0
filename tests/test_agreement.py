"""Two analyses that answer one question are set beside each other: values, intervals, by how many sigma they differ."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.agreement import agreement_note
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Note, Section
from groundstation.results.agreement import Agreement, OneFinding
from groundstation.results.answer import Answer, by_analysis
from groundstation.results.flight import FlightResults, Source
from groundstation.results.roles import AzimuthEstimate
from groundstation.systems.heading.agreement_answer import heading_agreement
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.chapter import heading as heading_chapter
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.latency.agreement_answer import latency_agreement, trajectory_agreement
from groundstation.systems.latency.answer import Latencies, Latency
from groundstation.systems.latency.chapter import latency as latency_chapter
from groundstation.systems.magnetic.agreement_answer import deviation_agreement
from groundstation.systems.magnetic.answer import DeclinationUsed, MagneticResult
from groundstation.systems.magnetic.chapter import magnetic as magnetic_chapter
from groundstation.systems.magnetic.estimate import estimate_deviation
from groundstation.systems.magnetic.ground_answer import GroundDeviation, GroundRun
from tests.states_example import MadeStates
from tests.systems.inertial.example import inertial_result
from tests.systems.magnetic.example import make, taxi_heading

EXACT_DEG = 1e-9


def results(*answers: Answer) -> FlightResults:
    source = Source("a.csv", "00" * 32, 0, "flat-csv")
    return FlightResults("NOTIME_00000000", source, {}, None, 0.0, "ok", answers=by_analysis(*answers))


def turns(error_deg: float | None, sigma_deg: float = 0.03, time_s: float | None = 0.0) -> InertialResult:
    azimuth = AzimuthEstimate(error_deg is not None, error_deg, sigma_deg, 6, 100.0, "6 turns", time_s)
    return inertial_result(ins_topic="ins", azimuth=azimuth)


def taxi(error_deg: float = 1.0, sigma_deg: float = 0.2, **changes: object) -> HeadingResult:
    platform = {"platform_error_deg": error_deg, "platform_standard_error_deg": sigma_deg}
    return taxi_heading(error_deg=error_deg, standard_error_deg=sigma_deg, **{**platform, **changes})


def motion(latency_s: float, half_width_s: float) -> Latencies:
    interval = (latency_s - half_width_s, latency_s + half_width_s)
    row = Latency("ins", "gnss", "velocity", "observed", "turns", latency_s, half_width_s / 1.96, interval)
    return Latencies((row,))


def notes_of(section: Section | None) -> list[Note]:
    assert section is not None
    return [part for part in section.parts if isinstance(part, Note) and part.text.startswith("Two analyses: ")]


# Heading by taxi and by turns


def test_heading_by_taxi_and_by_turns_with_the_drift_between_them() -> None:
    """1.0 +- 0.2 and 0.7 +- 0.03 two hours later: 0.3 over hypot(0.2, 0.03, 0.2)."""
    found = heading_agreement(by_analysis(taxi(), turns(0.7, time_s=7200.0)))
    assert found is not None
    assert found.difference == pytest.approx(0.3)
    assert found.sigmas == pytest.approx(0.3 / math.hypot(0.2, 0.03, 0.2))
    assert found.agrees


def test_the_platforms_number_is_compared_for_turns_do_not_see_the_mounting() -> None:
    answer = taxi(platform_error_deg=0.4, platform_standard_error_deg=0.25)
    found = heading_agreement(by_analysis(answer, turns(0.4)))
    assert found is not None
    assert (found.first.value, found.first.sigma, found.difference) == (0.4, 0.25, 0.0)


@pytest.mark.parametrize(
    "answers", [(taxi(),), (turns(0.7),), (taxi(), turns(None)), (taxi(ins_topic="ins.2"), turns(0.7))]
)
def test_one_analysis_alone_is_compared_with_nothing(answers: tuple[Answer, ...]) -> None:
    assert heading_agreement(by_analysis(*answers)) is None
    assert agreement_note(None) is None


@pytest.mark.parametrize(
    ("second", "tone", "told"),
    [
        (0.95, "good", "agree: they differ by 0.05°, 0.2 σ."),
        (0.5, "warn", "differ by 0.50°, 2.5 σ."),
        (0.0, "bad", "differ by 1.00°, 4.9 σ; at least one errs by more than its interval says."),
    ],
)
def test_the_line_gives_both_intervals_and_says_whether_they_agree(second: float, tone: str, told: str) -> None:
    note = agreement_note(heading_agreement(by_analysis(taxi(), turns(second))))
    assert note is not None
    assert note.tone == tone
    assert note.text.startswith("Two analyses: azimuth error of the INS by taxi +1.00° (95 % ")
    assert note.text.endswith(told)


def test_the_line_stands_once_in_the_chapter_and_so_in_page_paper_and_recording() -> None:
    section = heading_chapter(results(taxi(), turns(0.95)))
    (note,) = notes_of(section)
    assert note.text in markdown(section).replace("\\", "")
    assert not notes_of(heading_chapter(results(taxi())))


# Latency by motion and by the turns of the taxi


def test_latency_by_motion_and_by_turns_without_the_prior_counted_twice() -> None:
    """Motion says 0.2 +- 0.02, the turns alone 0.25 +- 0.015: together 0.232 +- 0.012, that is +0.032 to the former."""
    prior, own = 0.02, 0.015
    sigma = (prior**-2 + own**-2) ** -0.5
    offset = 0.05 * sigma**2 / own**2
    answer = taxi(time_offset_s=offset, time_offset_sigma_s=sigma, latency_used_s=0.2, latency_origin="motion")
    found = latency_agreement(by_analysis(answer, motion(0.2, 1.96 * prior)))
    assert found is not None
    assert found.second.value == pytest.approx(0.25, abs=1e-3)
    assert found.second.sigma == pytest.approx(own, rel=1e-3)
    assert found.sigmas == pytest.approx(0.05 / math.hypot(prior, own), rel=0.01)
    (note,) = notes_of(latency_chapter(results(answer, motion(0.2, 1.96 * prior))))
    assert note.text.endswith("agree: they differ by 0.050\u202fs, 2.0 σ.")


def test_turns_that_add_nothing_to_what_was_known_are_not_compared() -> None:
    answer = taxi(time_offset_s=0.001, time_offset_sigma_s=0.0199, latency_used_s=0.2, latency_origin="motion")
    assert latency_agreement(by_analysis(answer, motion(0.2, 1.96 * 0.02))) is None


def test_a_latency_of_the_aircraft_file_leaves_both_independent() -> None:
    answer = taxi(time_offset_s=0.01, time_offset_sigma_s=0.02, latency_used_s=0.1, latency_origin="aircraft file")
    found = latency_agreement(by_analysis(answer, motion(0.2, 1.96 * 0.02)))
    assert found is not None
    assert (found.second.value, found.second.sigma) == pytest.approx((0.11, 0.02))
    assert not found.agrees


# Deviation in the air and on ground runs


def on_ground(*runs: tuple[float, float], sigma_deg: float = 0.5) -> GroundDeviation:
    rows = tuple(
        GroundRun(0.0, 20.0, "taxi", heading, heading, 0.0, error, 0.3, sigma_deg, 20, 8.0, 1.0, "used")
        for heading, error in runs
    )
    used = DeclinationUsed(10.0, 0.4, "WMM")
    return GroundDeviation("ins", "gnss", used, rows, (), len(rows), 90.0, 0.0, ())


def in_the_air() -> MagneticResult:
    made = make()
    return estimate_deviation(made.flight, heading=taxi_heading(), phases=made.phases)


def test_deviation_in_the_air_and_on_ground_runs_at_the_headings_of_the_runs() -> None:
    air = in_the_air()
    method = air.method(air.recommended_method)
    headings = (40.0, 130.0, 250.0)
    columns = [np.array([1.0, np.sin(c), np.cos(c), np.sin(2 * c), np.cos(2 * c)]) for c in np.deg2rad(headings)]
    curve = [float(column @ np.array([method.coefficients_deg[letter] for letter in "ABCDE"])) for column in columns]
    same = deviation_agreement(by_analysis(air, on_ground(*zip(headings, curve, strict=True))))
    assert same is not None
    assert same.difference == pytest.approx(0.0, abs=EXACT_DEG)
    other = deviation_agreement(by_analysis(air, on_ground(*zip(headings, np.add(curve, 2.0).tolist(), strict=True))))
    assert other is not None
    assert other.difference == pytest.approx(-2.0)
    assert other.second.sigma == pytest.approx(0.3 / math.sqrt(3.0))  # 0.5 less the 0.4 of the declination
    (note,) = notes_of(magnetic_chapter(results(air, on_ground(*zip(headings, curve, strict=True)))))
    assert "in the air" in note.text and "on the ground" in note.text
    assert deviation_agreement(by_analysis(air)) is None


def test_sigmas_are_those_of_both() -> None:
    found = Agreement("x", "deg", OneFinding("a", 0.0, 0.3), OneFinding("b", 1.0, 0.4))
    assert found.sigmas == pytest.approx(2.0)
    assert replace(found, between_sigma=1.2).sigmas == pytest.approx(1.0 / 1.3)


# Latency by motion, and by the best trajectory against the raw inertial data


def test_latency_is_set_against_that_of_the_trajectory() -> None:
    """0.11 +- 0.01 by motion, 0.13 +- 0.006 by the trajectory: 0.02 over hypot(0.01, 0.006)."""
    answers = (motion(0.11, NORMAL_95 * 0.01), MadeStates(latency=(0.13, 0.006)))
    found = trajectory_agreement(by_analysis(*answers))
    assert found is not None
    assert found.sigmas == pytest.approx(0.02 / math.hypot(0.01, 0.006))
    (note,) = notes_of(latency_chapter(results(*answers)))
    assert note.tone == "good" and "by the best trajectory" in note.text and "agree" in note.text


@pytest.mark.parametrize("made", [MadeStates(latency=(0.3, 0.01), accepted=False), MadeStates()])
def test_a_trajectory_that_does_not_show_it_says_nothing(made: MadeStates) -> None:
    assert trajectory_agreement(by_analysis(motion(0.11, 0.02), made)) is None
    assert notes_of(latency_chapter(results(motion(0.11, 0.02), made))) == []
