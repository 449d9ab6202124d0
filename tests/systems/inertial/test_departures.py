"""Departures of an aided INS from GNSS: where it left, by how much, and whether it flew the aircraft."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.chapters.front import front
from groundstation.chapters.parts import Rank
from groundstation.pipeline.one_flight.analyse import run_analyses
from groundstation.systems import systems
from groundstation.systems.inertial.analysis import INERTIAL
from groundstation.systems.inertial.answer import Departure, FilterOfIns, InertialResult
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.known import Known
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight
from tests.real_logs import real_log
from tests.systems.inertial.flights import batch_of, changed, flight_of

METRES_PER_DEGREE = 111_195.0


@pytest.fixture(scope="module")
def aided() -> Flight:
    """A flight whose INS follows GNSS, and says so."""
    flight = replace(flight_of(batch_of()), metadata={"ins_kind": "gnss_aided"})
    gnss = flight["gnss"]
    names = ("latitude_deg", "longitude_deg", "velocity_north_mps", "velocity_east_mps")
    return changed(flight, "ins", **{name: np.array(gnss.values(name)) for name in names})


def shifted(flight: Flight, metres: np.ndarray) -> Flight:
    latitude = np.array(flight["ins"].values("latitude_deg")) + metres / METRES_PER_DEGREE
    return changed(flight, "ins", latitude_deg=latitude)


def away(flight: Flight, size_m: float, start_s: float, end_s: float) -> np.ndarray:
    time = flight.time_s("ins")
    return np.where((time >= start_s) & (time <= end_s), size_m, 0.0)


def found_in(flight: Flight) -> tuple[InertialResult, list[tuple[str, str]]]:
    known = Known(flight_phases(flight), settings={"inertial": InertialSettings()})
    found = run_analyses((INERTIAL,), flight, known)
    result = found.answers["inertial"]
    assert isinstance(result, InertialResult) and result.kind == "gnss_aided"
    return result, [(one.severity, one.place) for one in found.findings["inertial"] if one.code.endswith("departure")]


def test_a_filter_that_stays_with_gnss_has_not_left_it(aided: Flight) -> None:
    assert found_in(aided)[0].departures == ()


def test_epochs_compared_are_those_with_both_ins_and_gnss(aided: Flight) -> None:
    """A row that only closes the grid of the filter is no epoch: the table of differences and the count are one."""
    result = found_in(aided)[0]
    position = result.difference("position")
    assert position is not None and result.epochs == position.samples
    time_s = aided.time_s("gnss")
    later = aided["gnss"].take(time_s < time_s[-1] - 1.5)
    fewer = found_in(replace(aided, tables={**aided.tables, "gnss": later}))[0]
    shorter = fewer.difference("position")
    assert shorter is not None and fewer.epochs == shorter.samples


def test_a_departure_has_its_span_and_size(aided: Flight) -> None:
    result, told = found_in(shifted(aided, away(aided, 181.0, 1000.0, 1120.0)))
    (one,) = result.departures
    assert one.start_s == pytest.approx(1000.0, abs=1.5) and one.end_s == pytest.approx(1120.0, abs=1.5)
    assert one.largest_m == pytest.approx(181.0, rel=0.01) and not one.at_start and one.share_rejected is None
    assert [severity for severity, _ in told] == ["warn"] and result.worst_departure == one


@pytest.mark.parametrize(("size_m", "start_s", "end_s"), [(8.0, 1000.0, 1120.0), (500.0, 1000.0, 1003.0)])
def test_small_or_short_ones_are_none(aided: Flight, size_m: float, start_s: float, end_s: float) -> None:
    assert found_in(shifted(aided, away(aided, size_m, start_s, end_s)))[0].departures == ()


def test_a_late_fix_is_no_departure(aided: Flight) -> None:
    speed = np.hypot(aided["ins"].values("velocity_north_mps"), aided["ins"].values("velocity_east_mps"))
    late = np.where(aided.time_s("ins") % 600.0 < 60.0, 0.4 * speed, 0.0)  # for a minute in ten
    assert np.nanmax(late) > 50.0 and found_in(shifted(aided, late))[0].departures == ()


def test_a_filter_that_has_just_begun_is_told_and_is_no_danger(aided: Flight) -> None:
    result, told = found_in(shifted(aided, away(aided, 90.0, 0.0, 25.0)))
    assert [one.at_start for one in result.departures] == [True] and result.worst_departure is None
    assert [severity for severity, _ in told] == ["info"]


def test_two_close_by_are_one_and_the_worst_is_the_farthest(aided: Flight) -> None:
    metres = away(aided, 60.0, 500.0, 520.0) + away(aided, 80.0, 526.0, 550.0) + away(aided, 170.0, 900.0, 990.0)
    result, _ = found_in(shifted(aided, metres))
    assert len(result.departures) == 2 and result.worst_departure == result.departures[1]


def test_short_logs_of_aided_filters_are_compared_too(aided: Flight) -> None:
    tables = {name: aided[name].take(aided.time_s(name) < 60.0) for name in aided.topics()}
    assert found_in(replace(aided, tables=tables))[0].gnss_seconds < 100.0


@pytest.mark.parametrize(
    ("of", "words"),
    [
        (FilterOfIns(), ""),
        (FilterOfIns("EKF1", False, "AHRS_EKF_USE = 0"), "; it did not fly the aircraft (AHRS_EKF_USE = 0)"),
        (FilterOfIns("EKF3", True, "AHRS_EKF_TYPE = 3"), "; it flew the aircraft (AHRS_EKF_TYPE = 3)"),
    ],
)
def test_whether_it_flew_is_told_as_far_as_the_log_does(of: FilterOfIns, words: str) -> None:
    assert of.use == words


def test_sizes_are_told_as_far_as_they_are_known() -> None:
    assert Departure(0.0, 9.0, 180.9, 29.67).apart == "up to 181 m and 29.7 m/s "
    assert Departure(0.0, 9.0, None, None).apart == ""


def test_the_recorded_filter_that_left_gnss_is_what_the_report_opens_with() -> None:
    import groundstation

    results = groundstation.open(real_log("dataflash/erle_plane_4-12-2014_329.BIN")).results
    answer = results.answer(InertialResult)
    assert answer is not None and answer.filter_of_ins == FilterOfIns("EKF1", False, "AHRS_EKF_USE = 0")
    (one,) = answer.departures
    assert one.largest_m == pytest.approx(181.0, abs=1.0) and one.end_s - one.start_s > 120.0
    top = front(results, systems().chapters)
    assert top.verdict is not None and (top.verdict.tone, top.verdict.text) == ("warn", "Left GNSS")
    assert "181 m" in top.headline and "did not fly" in top.headline


def test_gnss_reception_stands_before_what_was_left_open() -> None:
    assert Rank.HEALTH < Rank.GNSS < Rank.HEADING_OPEN < Rank.INERTIAL_OPEN
