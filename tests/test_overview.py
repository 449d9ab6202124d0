"""What the overview draws: rows of merged sources, modes and arming as the log tells them, remarks joined by kind."""

import numpy as np
import pytest

from groundstation.base.findings import Finding
from groundstation.base.records import Column
from groundstation.chapters.plots.flight import altitude_name_of
from groundstation.methods.overview import altitude_facts, overview, state_lanes
from groundstation.results.figures import FigureData
from groundstation.results.flight import ALTITUDE_DATUM
from groundstation.results.grouped_findings import grouped
from groundstation.systems.heading.advice_chapter import WHAT_IT_NEEDS, explained
from groundstation.tables.table import Flight, Table
from tests.report_example import example
from tests.viewer_example import START_NS, table


def flight_of(*tables: Table, metadata: dict[str, str] | None = None) -> Flight:
    return Flight({one.topic: one for one in tables}, metadata or {}, START_NS, True, "a.ulg")


def merged_ins() -> Table:
    """An INS of three sources in turn, attitude ten times as often as position and velocity: no row has all fields."""
    time_s = np.arange(0.0, 60.0, 0.01)
    turn = np.arange(len(time_s)) % 12
    position, velocity = turn == 10, turn == 11
    columns = {
        "true_heading_deg": Column(np.full(len(time_s), 45.0), turn < 10),
        "latitude_deg": Column(56.0 + 1e-6 * time_s, position),
        "longitude_deg": Column(38.0 + 1e-6 * time_s, position),
        "altitude_msl_m": Column(100.0 + time_s, position),
        "velocity_north_mps": Column(np.full(len(time_s), 3.0), velocity),
        "velocity_east_mps": Column(np.full(len(time_s), 4.0), velocity),
    }
    return table("ins", time_s, **columns)


def lanes_of(figure: FigureData | None) -> dict[str, list[str]]:
    assert figure is not None
    names = list(dict.fromkeys(figure["lane"].tolist()))
    return {name: figure["state"][figure["lane"] == name].tolist() for name in names}


def test_fields_of_other_rows_are_taken_from_the_nearest_one() -> None:
    ins = merged_ins()
    figure = overview(flight_of(ins), np.where(ins.columns["true_heading_deg"].mask, 45.0, np.nan), "ins")
    assert figure is not None and len(figure) == np.count_nonzero(ins.columns["latitude_deg"].mask)
    np.testing.assert_allclose(figure["ground_speed_mps"], 5.0)
    np.testing.assert_allclose(figure["heading_deg"], 45.0)
    np.testing.assert_allclose(figure["altitude_m"], 100.0 + figure["time_s"])
    assert "pressure_altitude_m" not in figure.columns


def test_attitude_climb_and_airspeed_stand_beside_the_track() -> None:
    time_s = np.arange(0.0, 60.0, 0.1)
    ins = table(
        *("ins", time_s), roll_deg=0.5 * time_s, pitch_deg=-0.1 * time_s, true_heading_deg=np.full(len(time_s), 45.0)
    )
    slow = np.arange(0.0, 60.0, 1.0)
    place = {"latitude_deg": 56.0 + 1e-5 * slow, "longitude_deg": np.full(60, 38.0)}
    gnss = table("gnss", slow, **place, velocity_down_mps=np.full(60, -2.0))
    air = table("air", slow, indicated_airspeed_mps=np.full(60, 40.0))
    figure = overview(flight_of(ins, gnss, air), ins.values("true_heading_deg"), "ins")
    assert figure is not None and len(figure) == 60
    np.testing.assert_allclose(figure["roll_deg"], 0.5 * slow)
    np.testing.assert_allclose(figure["pitch_deg"], -0.1 * slow)
    np.testing.assert_allclose(figure["climb_mps"], 2.0)
    np.testing.assert_allclose(figure["indicated_airspeed_mps"], 40.0)
    assert "true_airspeed_mps" not in figure.columns


def test_what_is_missing_for_long_stays_missing() -> None:
    time_s = np.arange(0.0, 30.0, 0.5)
    known = (time_s < 10.0) | (time_s > 20.0)
    ins = table(
        "ins",
        time_s,
        latitude_deg=np.full(60, 56.0),
        longitude_deg=np.full(60, 38.0),
        altitude_msl_m=Column(np.full(60, 1.0), known),
    )
    figure = overview(flight_of(ins), None, "ins")
    assert figure is not None
    assert (np.isfinite(figure["altitude_m"]) == known).all()


def test_without_an_altitude_the_pressure_altitude_is_drawn_under_its_own_name() -> None:
    time_s = np.arange(0.0, 20.0, 0.1)
    ins = table("ins", time_s, true_heading_deg=np.zeros(200))
    baro = table("baro", time_s + 0.03, pressure_altitude_m=300.0 + time_s)
    figure = overview(flight_of(ins, baro), np.zeros(200), "ins")
    assert figure is not None and not np.isfinite(figure["altitude_m"]).any()
    np.testing.assert_allclose(figure["pressure_altitude_m"], 300.0 + time_s, atol=0.11)


def test_gnss_without_a_fix_keeps_its_rows() -> None:
    time_s = np.arange(0.0, 20.0, 0.2)
    has_fix = time_s >= 8.0
    position = {name: Column(np.full(100, 40.0), has_fix) for name in ("latitude_deg", "longitude_deg")}
    figure = overview(flight_of(table("gnss", time_s, **position)), None, None)
    assert figure is not None and figure["time_s"][0] == 0.0
    assert (np.isfinite(figure["latitude_deg"]) == has_fix).all()


@pytest.mark.parametrize(
    ("fields", "datum", "name"),
    [
        (("altitude_msl_m", "altitude_ellipsoid_m"), "MSL", "altitude MSL"),
        (("altitude_ellipsoid_m",), "ellipsoid", "ellipsoid height"),
        ((), None, "altitude"),
    ],
)
def test_the_altitude_of_the_overview_names_its_datum(fields: tuple[str, ...], datum: str | None, name: str) -> None:
    """The geoid is up to 100 m from the ellipsoid: an altitude without its datum cannot be held against a chart."""
    time_s = np.arange(0.0, 20.0, 0.2)
    columns = {one: Column(np.full(100, 40.0)) for one in ("latitude_deg", "longitude_deg", *fields)}
    facts = altitude_facts(flight_of(table("gnss", time_s, **columns)))
    assert facts.get(ALTITUDE_DATUM) == datum
    assert altitude_name_of(example(metadata=facts)) == name


def test_modes_arming_and_ground_contact_are_lanes() -> None:
    events = table(
        "event",
        np.array([0.0, 1.0, 5.0, 5.0, 9.0]),
        name=np.array(["disarmed", "mode STABILIZE", "armed", "mode LOITER", "fence enabled"]),
    )
    landed = table("discrete", np.arange(0.0, 20.0), weight_on_wheels=np.arange(20) < 6)
    derived = {"derived.discrete.weight_on_wheels": "landed flag of the autopilot"}
    figure = state_lanes(flight_of(events, landed, metadata=derived))
    assert lanes_of(figure) == {
        "mode": ["STABILIZE", "LOITER"],
        "arming": ["disarmed", "armed"],
        "landed flag": ["on the ground", "in the air"],
    }
    assert figure is not None
    assert figure["start_s"].tolist() == [1.0, 5.0, 0.0, 5.0, 0.0, 6.0]
    assert figure["end_s"].tolist() == [5.0, 19.0, 5.0, 19.0, 6.0, 19.0]


def test_a_switch_on_the_gear_is_called_so_and_silence_gives_no_lanes() -> None:
    wheels = table("discrete", np.arange(0.0, 20.0), weight_on_wheels=np.arange(20) < 6)
    assert list(lanes_of(state_lanes(flight_of(wheels)))) == ["weight on wheels"]
    markers = table("event", np.array([1.0]), name=np.array(["marker 1"]))
    assert state_lanes(flight_of(markers)) is None
    assert state_lanes(Flight({})) is None


@pytest.mark.parametrize("severity", ["warn", "fail"])
def test_only_remarks_on_raw_topics_are_joined(severity: str) -> None:
    remarks = [Finding("info", "values.nan", f"raw.t{n}.x: 1 of 2", f"raw.t{n}", "", 1) for n in range(9)]
    grave = [Finding(severity, "values.nan", f"{n}", f"raw.t{n}") for n in range(9)]  # type: ignore[arg-type]
    ours = [Finding("info", "time.duplicates", f"{n}", f"gnss.{n}") for n in range(9)]
    few = [Finding("info", "data.gaps", f"{n}", f"raw.t{n}") for n in range(3)]
    joined = grouped([*remarks, *grave, *ours, *few])
    assert joined[1:] == (*grave, *ours, *few)
    text = "9 fields of raw topics hold NaN as the device wrote it: t0, t1, t2, t3, t4 and 4 more"
    assert (joined[0].text, joined[0].count) == (text, 9)
    assert grouped([]) == ()


def test_a_log_without_taxi_is_told_what_the_method_needs() -> None:
    assert WHAT_IT_NEEDS in explained("ground speed never above 6 m/s before lift-off: highest 1.4 m/s")
    assert explained("no GNSS velocity") == "no GNSS velocity"


def test_a_log_of_attitude_alone_has_an_overview() -> None:
    time_s = np.arange(0.0, 30.0, 0.1)
    ins = table("ins", time_s, roll_deg=np.full(300, 4.0), magnetic_heading_deg=np.full(300, 90.0))
    baro = table("baro", time_s[::5], height_above_airfield_m=np.full(60, 120.0))
    figure = overview(flight_of(ins, baro), None, None)
    assert figure is not None and len(figure) == 300
    assert np.isnan(figure["latitude_deg"]).all()
    for name, value in (("roll_deg", 4.0), ("magnetic_heading_deg", 90.0), ("height_above_airfield_m", 120.0)):
        np.testing.assert_allclose(figure[name], value)
    assert "pitch_deg" not in figure.columns
