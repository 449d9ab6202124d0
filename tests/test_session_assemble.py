"""Logs of several aircraft as one session: the clock they share, and everything that can be wrong with them."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.findings import Finding
from groundstation.base.local_frame import LocalFrame
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.tables.session import DeadReckoning, Session
from groundstation.tables.session_assemble import AssembledSession, session_from_flights
from groundstation.tables.session_settings import SessionSettings, Station, Stations
from groundstation.tables.table import Flight
from tests.session_example import (
    LOCAL,
    WITH_POINTS,
    recorded,
    shifted,
    simulated,
    stations_of,
    with_table,
    with_values,
    without,
)

ROUNDING_M = 1e-5  # of geodetic positions of 6e6 m, there and back
TILT_DEG = 2e-3  # level here is not level 60 km away: half the square of half a degree
NANOSECONDS_M = 1e-6  # 1 ns of flight at 220 m/s, and more
WEEK_S = 604_800.0
QUIET = {"session.clock_offset"}  # of less than the limit: told, and harmless


def assembled(*flights: Flight, stations: Stations | None = None) -> AssembledSession:
    return session_from_flights(flights or recorded(), stations or stations_of())


def only(found: AssembledSession, code: str) -> Finding:
    """The one finding, of that code."""
    told = [finding for finding in found.findings if finding.code not in QUIET]
    assert [finding.code for finding in told] == [code], told
    return told[0]


def assert_same(session: Session, expected: Session) -> None:
    """Equal but for the nanoseconds of a log and the rounding of geodetic positions."""
    assert session.names == expected.names
    assert session.frame == expected.frame
    for one, other in zip(session.vehicles, expected.vehicles, strict=True):
        assert isinstance(one, DeadReckoning)
        assert isinstance(other, DeadReckoning)
        assert one.time_s == pytest.approx(other.time_s, abs=1e-9)
        assert one.position_m == pytest.approx(other.position_m, abs=ROUNDING_M)
        assert one.velocity_mps == pytest.approx(other.velocity_mps, abs=1e-6)
        assert one.axes == pytest.approx(other.axes, abs=1e-9)
        turn = (one.heading_deg - other.heading_deg + 180.0) % 360.0 - 180.0
        assert turn == pytest.approx(0.0, abs=TILT_DEG)
    for point, other_point in zip(session.points, expected.points, strict=True):
        assert point.position_m == pytest.approx(other_point.position_m, abs=ROUNDING_M)
    ranges, others = session.ranges, expected.ranges
    assert ranges.receiver.tolist() == others.receiver.tolist()
    assert ranges.source.tolist() == others.source.tolist()
    assert ranges.slot.tolist() == others.slot.tolist()
    assert ranges.time_s == pytest.approx(others.time_s, abs=2e-9)
    assert ranges.pseudorange_m == pytest.approx(others.pseudorange_m, abs=NANOSECONDS_M)
    one_sky, other_sky = (  # rows of one time in any order
        sorted(zip(sky.time_s, sky.receiver, sky.satellite, sky.pseudorange_m, *sky.position_m.T, strict=True))
        for sky in (session.satellites, expected.satellites)
    )
    assert len(one_sky) == len(other_sky)
    for row, other_row in zip(one_sky, other_sky, strict=True):
        assert row[1:3] == other_row[1:3]
        assert row[3:] == pytest.approx(other_row[3:], abs=NANOSECONDS_M)


@pytest.mark.parametrize("scenario", [WITH_POINTS, LOCAL], ids=["globe", "plane"])
def test_the_flights_of_a_session_give_the_session(scenario: object) -> None:
    found = session_from_flights(recorded(scenario), stations_of(scenario))  # type: ignore[arg-type]
    expected = simulated(scenario)  # type: ignore[arg-type]
    assert_same(found.session, expected.session)
    assert not found.findings
    assert found.has_utc
    for truth in expected.truth:
        time_s, position = found.truth[truth.name]
        assert time_s == pytest.approx(truth.time_s, abs=1e-9)
        assert position == pytest.approx(truth.position_m, abs=ROUNDING_M)
    assert found.duration_s == pytest.approx(60.0)


def test_ranks_are_those_of_the_stations_file_and_else_those_broadcast() -> None:
    a, b, c = recorded()
    heard = with_values(a, "link.B", "rank", np.full(len(a["link.B"]), 7.0))
    assert assembled(heard, b, c).session.ranks == {"A": 1, "B": 1, "C": 2, "N1": 0, "N2": 0}
    bare = replace(stations_of(), ranks={})
    assert assembled(heard, b, c, stations=bare).session.ranks == {"B": 7, "N1": 0, "N2": 0}


def test_the_order_of_the_logs_does_not_count() -> None:
    forth, back = assembled(*recorded()), assembled(*reversed(recorded()))
    assert_same(forth.session, back.session)
    assert forth.start_ns == back.start_ns


@pytest.mark.parametrize("shift_s", [0.5, WEEK_S, -WEEK_S])
def test_one_clock_that_is_off_is_put_right_and_told(shift_s: float) -> None:
    a, b, c = recorded()
    found = assembled(a, shifted(b, shift_s), c)
    assert_same(found.session, simulated().session)
    told = [finding for finding in found.findings if finding.code == "session.clock_offset"]
    assert [(finding.severity, finding.topic) for finding in told] == [("warn", "B")]
    assert f"{shift_s:+.3f} s" in told[0].text
    assert {row.aircraft: row.offset_s for row in found.clocks} == {"A": 0.0, "B": pytest.approx(shift_s), "C": 0.0}
    assert [row.is_corrected for row in found.clocks] == [False, True, False]


def test_of_two_clocks_nobody_knows_which_is_off() -> None:
    a, b, _ = (without(flight, "link.C") for flight in recorded())
    found = assembled(a, shifted(b, WEEK_S))
    assert "no majority" in only_warning(found, "session.clock_offset").text
    assert found.session.names == ("A", "B")


def only_warning(found: AssembledSession, code: str) -> Finding:
    told = [finding for finding in found.findings if finding.severity != "info"]
    assert [finding.code for finding in told] == [code], told
    return told[0]


def test_a_small_offset_in_utc_may_be_a_delay_and_stays() -> None:
    a, b, c = recorded()
    found = assembled(a, shifted(b, 0.1), c)
    (told,) = found.findings
    assert (told.severity, told.code) == ("info", "session.clock_offset")
    assert found.clocks[1].offset_s == pytest.approx(0.1)
    assert found.session.vehicles[1].time_s[0] == pytest.approx(0.1)


def test_a_clock_that_leaps_is_put_right_stretch_by_stretch() -> None:
    a, b, c = recorded()
    half = int(b["ins"].record_index[30])
    found = assembled(a, shifted(b, 7.0, from_record=half), c)
    leap = next(finding for finding in found.findings if finding.code == "session.clock_leap")
    assert (leap.count, leap.topic, leap.place) == (1, "B", "B.csv")
    expected = simulated().session
    track, other = found.session.vehicles[1], expected.vehicles[1]
    kept = other.time_s != 30.0  # between the last range before the leap and the first behind it
    assert track.time_s == pytest.approx(other.time_s[kept], abs=1e-9)
    assert isinstance(track, DeadReckoning)
    assert isinstance(other, DeadReckoning)
    assert track.position_m == pytest.approx(other.position_m[kept], abs=ROUNDING_M)
    assert len(found.session.ranges) == len(expected.ranges)


def test_logs_without_utc_are_related_by_the_link() -> None:
    flights = [replace(shifted(flight, -1e9 + 50.0 * k), has_utc=False) for k, flight in enumerate(recorded())]
    found = assembled(*flights)
    assert_same(found.session, simulated().session)
    assert not found.has_utc
    assert not found.findings


def test_one_log_without_utc_takes_that_of_the_others() -> None:
    a, b, c = recorded()
    found = assembled(a, replace(shifted(b, -1.5e9), has_utc=False), c)
    assert_same(found.session, simulated().session)
    assert found.has_utc
    assert found.start_ns == assembled().start_ns
    assert [row.offset_s for row in found.clocks] == [0.0, None, 0.0]


def test_a_log_that_nothing_places_is_left_out() -> None:
    a, b, c = recorded()
    links = [topic for topic in c.topics() if topic.startswith("link.")]
    found = assembled(a, b, replace(without(c, *links), has_utc=False))
    assert found.session.names == ("A", "B")
    assert {finding.code for finding in found.findings} == {"session.no_clock", "session.unknown_source"}


def test_without_times_of_transmission_the_log_and_the_travel_time_tell_them() -> None:
    flights = []
    for flight in recorded():
        for topic in (topic for topic in flight.topics() if topic.startswith("link.")):
            table = flight[topic]
            columns = {name: column for name, column in table.columns.items() if name != "transmission_time_s"}
            flight = with_table(flight, replace(table, columns=columns))
        flights.append(flight)
    found = assembled(*flights)
    assert found.session.ranges.time_s == pytest.approx(simulated().session.ranges.time_s, abs=2e-9)
    assert [row.ranges for row in found.clocks] == [0, 0, 0]


def test_logs_that_do_not_overlap() -> None:
    a, b, c = recorded()
    links = [topic for topic in c.topics() if topic.startswith("link.")]
    found = assembled(without(a, "link.C"), without(b, "link.C"), shifted(without(c, *links), 3600.0))
    told = only(found, "session.no_overlap")
    assert (told.severity, told.topic, told.place) == ("warn", "C", "C.csv")
    assert "3540 s" in told.text
    assert found.session.names == ("A", "B")


def test_the_log_of_a_peer_is_missing() -> None:
    a, b, _ = recorded()
    told = only(assembled(a, b), "session.unknown_source")
    assert (told.topic, told.place, told.count) == ("link.C", "A, B", 120)


def test_ranges_of_an_aircraft_to_itself_are_left_out() -> None:
    a, b, c = recorded()
    own = replace(a["link.B"], topic="link.A")
    told = only(assembled(with_table(a, own), b, c), "session.unknown_source")
    assert (told.topic, told.count) == ("link.A", 60)
    assert "its own" in told.text


def test_the_same_aircraft_twice() -> None:
    a, b, c = recorded()
    half = replace(a, tables={name: table.take(slice(0, 20)) for name, table in a.tables.items()}, source_name="x.csv")
    found = assembled(half, a, b, c)
    told = only(found, "session.same_aircraft")
    assert (told.topic, told.place, told.count) == ("A", "x.csv", 2)
    assert_same(found.session, simulated().session)


def test_a_station_far_from_every_range_that_names_it() -> None:
    right = stations_of()
    first = right.stations[0]
    wrong = replace(right, stations=(replace(first, latitude_deg=first.latitude_deg - 1.0), *right.stations[1:]))
    found = assembled(stations=wrong)
    told = only(found, "session.station_far")
    assert (told.topic, told.place, told.count) == ("link.N1", "N1", 180)
    assert "N1" not in found.session.ranges.source.tolist()
    assert "N2" in found.session.ranges.source.tolist()


def test_ranges_that_are_no_numbers() -> None:
    a, b, c = recorded()
    read = a["link.B"].values("pseudorange_m").copy()
    read[[3, 7]] = np.nan
    found = assembled(with_values(a, "link.B", "pseudorange_m", read), b, c)
    told = only(found, "session.not_a_number")
    assert (told.topic, told.count) == ("link.B", 2)
    assert told.place.startswith("A, from record ")
    assert len(found.session.ranges) == len(simulated().session.ranges) - 2


def test_negative_ranges() -> None:
    a, b, c = recorded()
    read = a["link.B"].values("pseudorange_m").copy()
    read[5], read[[8, 9, 10]] = -50_000.0, -100.0
    found = assembled(with_values(a, "link.B", "pseudorange_m", read), b, c)
    told = [(one.severity, one.code, one.count) for one in found.findings]
    assert told == [("warn", "session.negative_range", 1), ("info", "session.negative_range", 3)]
    assert len(found.session.ranges) == len(simulated().session.ranges) - 1


def test_two_way_ranges_have_no_clock_in_them() -> None:
    flights = recorded()
    for two_way in (False, True):
        found = session_from_flights(flights, stations_of(), settings=SessionSettings(two_way=two_way))
        assert found.session.ranges.is_two_way is two_way
        assert found.session.ranges.take(slice(0, 5)).is_two_way is two_way


def test_a_negative_range_there_and_back_is_left_out_and_no_clock_explains_it() -> None:
    a, b, c = recorded()
    read = a["link.B"].values("pseudorange_m").copy()
    read[:3] = -20.0
    flights = (with_values(a, "link.B", "pseudorange_m", read), b, c)
    found = session_from_flights(flights, stations_of(), settings=SessionSettings(two_way=True))
    (told,) = (one for one in found.findings if one.code == "session.negative_range")
    assert (told.severity, told.count, told.text) == ("warn", 3, "left out 3 negative ranges that no clock explains")
    assert len(found.session.ranges) == len(simulated().session.ranges) - 3


def test_a_time_of_transmission_that_is_not_that_of_the_log() -> None:
    a, b, c = recorded()
    sent = a["link.B"].values("transmission_time_s").copy()
    sent[[4, 11]] += WEEK_S
    found = assembled(with_values(a, "link.B", "transmission_time_s", sent), b, c)
    assert only(found, "session.stray_time").count == 2
    assert len(found.session.ranges) == len(simulated().session.ranges) - 2


@pytest.mark.parametrize("field", ["latitude_deg", "velocity_north_mps", "altitude_ellipsoid_m"])
def test_a_log_without_dead_reckoning(field: str) -> None:
    a, b, c = recorded()
    nothing = np.full(len(c["ins"]), np.nan)
    found = assembled(a, b, with_values(c, "ins", field, nothing))
    codes = {finding.code: finding for finding in found.findings}
    assert set(codes) == {"session.no_dead_reckoning", "session.unknown_source"}
    assert codes["session.no_dead_reckoning"].topic == "C"
    assert found.session.names == ("A", "B")


def test_height_is_that_of_the_barometer_where_the_ins_has_none() -> None:
    a, b, c = recorded()
    ins = c["ins"]
    height = ins.values("altitude_ellipsoid_m")
    columns = {name: column for name, column in ins.columns.items() if name != "altitude_ellipsoid_m"}
    baro = replace(ins, topic="baro", columns={"pressure_altitude_m": Column(height)})
    found = assembled(a, b, with_table(with_table(c, replace(ins, columns=columns)), baro))
    assert only(found, "session.height").text == "height of C is the pressure altitude of baro"
    assert_same(found.session, simulated().session)


def test_dead_reckoning_is_thinned_to_its_step() -> None:
    found = session_from_flights(recorded(), stations_of(), settings=SessionSettings(epoch_s=5.0))
    assert found.session.vehicles[0].time_s == pytest.approx(np.arange(0.0, 60.1, 5.0))


def test_nothing_at_all_is_a_session_without_vehicles() -> None:
    found = session_from_flights([])
    assert found.session.names == ()
    assert found.duration_s == 0.0
    empty = Flight({}, {"aircraft": "A"}, 0, has_utc=True, source_name="a.csv")
    assert only(session_from_flights([empty]), "session.no_dead_reckoning").topic == "A"


def test_no_absolute_time_is_ever_a_float() -> None:
    """Seconds of today step by 238 ns: the session's times must not."""
    flights = [shifted(flight, 1e-9 * 137) for flight in recorded()]
    found = assembled(*flights)
    assert found.start_ns == assembled().start_ns + 137
    assert found.session.ranges.time_s == pytest.approx(simulated().session.ranges.time_s, abs=2e-9)
    assert found.start_ns % NS_PER_S == 137


def test_a_local_frame_keeps_distances_and_turns_directions() -> None:
    """Origin on the equator: 1 degree north of it up is tilted by a degree, and a velocity north with it."""
    frame = LocalFrame(0.0, 0.0)
    turned = frame.turned_from([1.0], [0.0], [[100.0, 0.0, 0.0]])[0]
    assert turned == pytest.approx([100.0 * np.cos(np.deg2rad(1.0)), 0.0, 100.0 * np.sin(np.deg2rad(1.0))])
    assert frame.turned_to([1.0], [0.0], [turned])[0] == pytest.approx([100.0, 0.0, 0.0], abs=1e-12)


def test_stations_must_differ_in_name() -> None:
    from groundstation.base.errors import SettingsError

    one = Station("N1", 1.0, 2.0, 3.0)
    with pytest.raises(SettingsError, match="N1"):
        Stations((one, one))
