"""Runway of an approach from the table: which, how sure, its errors in the interval; bad input."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.runways.table import RunwayTable
from groundstation.pipeline.api import open_flight
from groundstation.pipeline.one_flight.analyse import known_of
from groundstation.pipeline.one_flight.configuration import load_configuration
from groundstation.simulation.approach import Recorded, load_approach, simulate_approach
from groundstation.systems.analysis import Found
from groundstation.systems.known import Known, SiteData
from groundstation.systems.landing.along_study import ALONG_FAMILIES, flown, measured_along
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import Approach, LandingResult
from groundstation.systems.landing.runway_choice import SURE, EndOfApproach, choose_runway, named
from groundstation.systems.landing.runway_study import FAMILIES, study_runways
from groundstation.systems.landing.settings import LandingSettings
from groundstation.tables.phases import flight_phases
from tests.real_logs import real_log
from tests.systems.landing.test_approaches import EXACT, PLAIN, changed, site, without

SETTINGS = LandingSettings()
COURSE_DEG, LENGTH_M = 47.0, 3_000.0  # of the simulated runway at 56 N 38 E


def table(*rows: dict[str, object]) -> RunwayTable:
    """A table of runways parallel to the simulated one: aside to the right, displaced, closed, turned."""
    made = []
    for given in rows or ({},):
        row = {"aside_m": 0.0, "displaced_m": 0.0, "closed": False, "turned_deg": 0.0, "name": "05", "surface": "ASP"}
        row |= given
        course = np.deg2rad(COURSE_DEG + float(row["turned_deg"]))  # type: ignore[arg-type]
        aside, back = float(row["aside_m"]), float(row["displaced_m"])  # type: ignore[arg-type]
        ends = [
            latitude_longitude_deg(
                along * np.cos(course) - aside * np.sin(course),
                along * np.sin(course) + aside * np.cos(course),
                56.0,
                38.0,
            )
            for along in (-back, LENGTH_M - back)
        ]
        made.append((row, np.array(ends, dtype=np.float64)))
    made.sort(key=lambda item: float(item[1][0, 0]))
    return RunwayTable(
        source="made",
        licence="none",
        dated="2026-01-01",
        digest="0" * 64,
        rows=len(made),
        left_out={},
        airport=np.array(["SIM"] * len(made)),
        surface=np.array([row["surface"] for row, _ends in made]),
        name=np.array([[row["name"] for row, _ends in made], [f"{row['name']}X" for row, _ends in made]]),
        latitude_deg=np.array([ends[:, 0] for _row, ends in made]).T,
        longitude_deg=np.array([ends[:, 1] for _row, ends in made]).T,
        elevation_m=np.full((2, len(made)), 100.0),
        displaced_m=np.array([[row["displaced_m"] for row, _ends in made], [0.0] * len(made)], dtype=np.float64),
        length_m=np.full(len(made), LENGTH_M),
        width_m=np.full(len(made), 45.0),
        is_closed=np.array([bool(row["closed"]) for row, _ends in made]),
    )


def analysed(
    flight: object, listed: RunwayTable | None, where: SiteData | None = None, **settings: object
) -> Found[LandingResult]:
    known = Known(flight_phases(flight), site=where or SiteData(), find_runways=lambda: (listed, ""))  # type: ignore[arg-type]
    return LANDING.run(flight, known, LandingSettings(**settings))  # type: ignore[arg-type]


def last(found: Found[LandingResult]) -> Approach:
    return found.answer.approaches[-1]


def codes(found: Found[LandingResult]) -> set[str]:
    return {finding.code for finding in found.findings}


@pytest.fixture(scope="module")
def landed() -> object:
    return simulate_approach(replace(PLAIN, recorded=replace(EXACT, across_m=40.0, along_m=-60.0))).flight


def test_the_runway_of_the_table_is_named_and_makes_a_reference(landed: object) -> None:
    found = analysed(landed, table(), reference_height_m=0.0)  # the simulated antenna is at the wheels
    one = last(found)
    assert (one.runway.name, one.runway.placed_by) == ("SIM 05", "runway table")
    assert one.runway.choice is not None and one.runway.choice.state == "decided"
    assert one.runway.choice.candidates[0].probability > SURE
    assert {"landing.runway_of_table"} <= codes(found) and "landing.runway_placed" not in codes(found)
    (across,), (along,) = one.position_errors, one.along_errors
    assert across.error_m == pytest.approx(40.0, abs=2.0)
    by_table = next(part.sigma_m for part in across.parts if part.name == "place of the threshold")
    assert across.sigma_m is not None and across.sigma_m > by_table > 15.0
    assert along.error_m == pytest.approx(-60.0, abs=12.0)  # heights are whole feet: 6 m along
    assert along.sigma_m is not None and 80.0 < along.sigma_m < 200.0
    assert one.touchdown is not None and one.touchdown.past_threshold_m is not None


def test_the_site_file_stands_above_the_table(landed: object) -> None:
    one = last(analysed(landed, table({"aside_m": 30.0}), site(PLAIN)))
    assert (one.runway.name, one.runway.placed_by, one.runway.choice) == ("05", "site file", None)


def test_parallel_runways_that_an_ins_does_not_tell_apart_are_both_named(landed: object) -> None:
    pair = table({"name": "05L", "aside_m": -100.0}, {"name": "05R", "aside_m": 120.0})
    found = analysed(landed, pair)
    one = last(found)
    assert one.runway.placed_by == "positions" and one.runway.choice is not None
    assert one.runway.choice.state == "not decided" and one.runway.name in ("SIM 05R or 05L", "SIM 05L or 05R")
    assert one.position_errors[0].state == one.along_errors[0].state == "not measured"
    assert "landing.runway_not_decided" in codes(found)
    far = last(analysed(landed, table({"name": "05L"}, {"name": "05R", "aside_m": 1_900.0})))
    assert far.runway.name == "SIM 05L"


def test_a_displaced_threshold_is_told_with_the_error_from_the_end(landed: object) -> None:
    one = last(analysed(landed, table({"displaced_m": 400.0})))
    assert one.runway.displaced_m == 400.0 and one.runway.landing_length_m == pytest.approx(2_600.0)
    (along,) = one.along_errors
    assert along.error_m is not None and along.error_from_end_m == pytest.approx(along.error_m + 400.0)


def test_a_closed_runway_gives_way_to_an_open_one_and_is_told(landed: object) -> None:
    both = table({"name": "05"}, {"name": "04", "closed": True})
    one = last(analysed(landed, both))
    assert one.runway.choice is not None and one.runway.choice.candidates[0].name == "SIM 05"
    found = analysed(landed, table({"closed": True}))
    told = last(found).runway
    assert told.choice is not None and told.choice.candidates[0].is_closed
    assert told.placed_by == "positions" or "landing.runway_closed" in codes(found)


def test_none_near_is_an_answer(landed: object) -> None:
    for listed in (table({"turned_deg": 90.0}), table({"aside_m": 30_000.0})):
        found = analysed(landed, listed)
        one = last(found)
        assert one.runway.name == "" and one.runway.placed_by == "positions"
        assert one.runway.choice is not None and one.runway.choice.state == "none"
        assert "none within 2.0 km on a course of" in one.runway.choice.reason
        assert "landing.runway_placed" in codes(found)
    near, far = (
        last(analysed(landed, one)).runway.choice for one in (table({"turned_deg": 90.0}), table({"aside_m": 3e4}))
    )
    assert near is not None and "SIM 05" in near.reason
    assert far is not None and "none of any course within 20 km" in far.reason


def test_a_lane_on_water_is_less_likely_than_a_runway(landed: object) -> None:
    both = table({"name": "05"}, {"name": "04W", "surface": "WATER"})
    choice = last(analysed(landed, both)).runway.choice
    assert choice is not None and choice.candidates[0].name == "SIM 05"


def test_a_go_around_finds_its_runway_ahead() -> None:
    scenario = replace(PLAIN, flown=replace(PLAIN.flown, go_around_height_m=150.0), recorded=EXACT)
    one = last(analysed(simulate_approach(scenario).flight, table()))
    assert one.outcome == "go-around" and one.runway.name == "SIM 05"
    assert one.runway.choice is not None and one.runway.choice.candidates[0].past_threshold_m < -2_000.0


def test_a_log_without_heights_or_glide_path_says_what_is_not_measured(landed: object) -> None:
    bare = without(landed, "baro", "radio_altimeter")  # type: ignore[arg-type]
    (along,) = last(analysed(bare, table())).along_errors
    assert (along.state, along.reason) == ("not measured", "no height above the threshold")
    radio = without(landed, "baro")  # type: ignore[arg-type]
    (along,) = last(analysed(radio, table())).along_errors
    assert along.state == "not measured" and "ground below" in along.reason
    dots = landed["guidance"].values("vertical_deviation_dots")  # type: ignore[index]
    blind = changed(landed, "guidance", "vertical_deviation_dots", np.full(len(dots), np.nan))  # type: ignore[arg-type]
    (along,) = last(analysed(blind, table())).along_errors
    assert (along.state, along.reason) == ("not measured", "no glide path in the log")


def test_errors_of_coarse_positions_are_inside_the_intervals() -> None:
    scenario = replace(load_approach("ils-approach"), recorded=Recorded(across_m=150.0, along_m=-200.0))
    scenario = replace(scenario, runway=PLAIN.runway)
    one = last(analysed(simulate_approach(scenario).flight, table(), reference_height_m=0.0))
    for error, truth_m in ((one.position_errors[0], 150.0), (one.along_errors[0], -200.0)):
        assert error.confidence95_m is not None
        assert error.confidence95_m[0] < truth_m < error.confidence95_m[1]


def test_ends_that_are_nowhere_choose_nothing() -> None:
    for end in (
        EndOfApproach(float("nan"), 38.0, 47.0, None, 15.0),
        EndOfApproach(90.0, 0.0, 47.0, None, 15.0),
        EndOfApproach(0.0, 180.0, 360.0, 0.0, 15.0),
    ):
        assert choose_runway(end, table(), SETTINGS).choice.state == "none"


def test_names_of_one_airport_are_joined(landed: object) -> None:
    pair = table({"name": "05L", "aside_m": -100.0}, {"name": "05R", "aside_m": 120.0})
    choice = last(analysed(landed, pair)).runway.choice
    assert choice is not None and named(choice).count("SIM") == 1


def test_a_damaged_table_of_the_user_is_a_finding(
    landed: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    (tmp_path / "groundstation").mkdir()
    (tmp_path / "groundstation" / "runways.npz").write_bytes(b"no table")
    known = known_of(landed, load_configuration())  # type: ignore[arg-type]
    found = LANDING.run(landed, known, SETTINGS)
    (told,) = [finding for finding in found.findings if finding.code == "landing.runway_table"]
    assert told.severity == "warn" and "runways update" in told.text and "\n" not in told.text


def test_the_studies_name_right_runways_and_hold_truths() -> None:
    receiver, unlisted = FAMILIES[0], next(one for one in FAMILIES if not one.is_listed)
    (data,) = study_runways(40, 5, families=(receiver, unlisted)).tables
    assert data["decided"][0] > 0.8 and data["right"][0] > 0.97 and data["decided"][1] < 0.1
    scenario, listed = flown(ALONG_FAMILIES[0], np.random.default_rng((71, 0)))
    again, _listed = flown(ALONG_FAMILIES[0], np.random.default_rng((71, 0)))
    assert scenario == again
    found = measured_along(scenario, listed)
    assert found is None or found[1].sigma_m is not None


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("log", "names", "errors"),
    [
        ("approach/Specimen_Flight.hdf5", ("ENGM 01L",), (-9.0,)),
        ("approach/flight_with_go_around_and_landing.hdf5", ("OAKN 23", "OMDB 30L"), (-15.0, -101.0)),
        ("g1000/log_220417_125002_LFQA.csv", ("LFAQ 08",), ()),
        ("g1000/log_210623_141501_TEST1.csv", ("EGTF 06",), ()),
    ],
)
def test_recorded_landings_are_on_their_runways(log: str, names: tuple[str, ...], errors: tuple[float, ...]) -> None:
    flight = open_flight(real_log(log)).flight
    found = LANDING.run(flight, known_of(flight, load_configuration()), SETTINGS)
    assert tuple(one.runway.name for one in found.answer.approaches) == names
    measured = [error for one in found.answer.approaches for error in one.position_errors if error.state == "measured"]
    assert [error.error_m for error in measured] == [pytest.approx(one, abs=3.0) for one in errors]
    assert all(error.sigma_m is not None and 40.0 < error.sigma_m < 80.0 for error in measured)


def test_headings_play_no_part(landed: object) -> None:
    heading = landed["ins"].values("true_heading_deg")  # type: ignore[index]
    magnetic = changed(landed, "ins", "true_heading_deg", (heading - 12.0) % 360.0)  # type: ignore[arg-type]
    assert last(analysed(magnetic, table())).runway == last(analysed(landed, table())).runway


def test_an_offset_course_and_a_place_away_from_runways_choose_nothing() -> None:
    listed = table()
    (one, _other) = listed.of_airport("SIM")
    over = (one.latitude_deg + 0.002, one.longitude_deg + 0.004)
    circling = EndOfApproach(*over, COURSE_DEG + 20.0, None, 15.0)
    assert choose_runway(circling, listed, SETTINGS).choice.state == "none"
    helipad = EndOfApproach(over[0] + 0.01, over[1], COURSE_DEG, None, 15.0)  # 600 m beside the runway, on its course
    assert choose_runway(helipad, listed, SETTINGS).choice.state != "decided"
    landed_on = EndOfApproach(*over, one.true_course_deg, None, 15.0)
    assert choose_runway(landed_on, listed, SETTINGS).choice.state == "decided"
