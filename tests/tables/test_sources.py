"""The source chosen by what is needed, and why GNSS does not serve: a receiver that never had a fix is told as such."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import groundstation
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import HEADING_IS_TRACK, Column
from groundstation.base.units import NS_PER_S
from groundstation.tables.sources import GNSS_VELOCITY, Need, PairNeed, choose_pair, why_without_gnss
from groundstation.tables.table import Flight, Table
from tests.readers.receiver_writer import pvt, ubx, week_ms


def flight_of(**columns: Column) -> Flight:
    places = np.arange(len(next(iter(columns.values()))), dtype=np.int64)
    return Flight({"gnss": Table("gnss", places, columns, places, Column(places))})


HEADING = Need("ins", "INS heading", ("true_heading_deg",), or_else=("magnetic_heading_deg",), is_nose=True)
STRAIGHT = PairNeed("heading", HEADING, GNSS_VELOCITY)


def of_seconds(topic: str, seconds: int, *names: str) -> Table:
    time_ns = np.arange(seconds, dtype=np.int64) * NS_PER_S
    return Table(topic, time_ns, {name: Column(np.ones(seconds)) for name in names}, time_ns, Column(time_ns))


def flight_with(*tables: Table) -> Flight:
    return Flight({table.topic: table for table in tables})


GNSS = of_seconds("gnss", 9, "velocity_north_mps", "velocity_east_mps")


def test_the_better_fields_come_first_and_a_track_last() -> None:
    magnetic, true = of_seconds("ins", 9, "magnetic_heading_deg"), of_seconds("ins.2", 9, "true_heading_deg")
    assert choose_pair(flight_with(magnetic, true, GNSS), STRAIGHT) == ("ins.2", "gnss")
    tracked = Flight(
        {one.topic: one for one in (magnetic, true, GNSS)}, {f"{HEADING_IS_TRACK}.ins.2.true_heading_deg": ""}
    )
    assert choose_pair(tracked, STRAIGHT) == ("ins", "gnss")
    with pytest.raises(NotAssessableError, match=r"heading: the heading of ins\.2 is the receiver's own track"):
        choose_pair(tracked, STRAIGHT, "ins.2")


def test_the_longest_is_taken_where_it_is_asked_for_by_whole_minutes() -> None:
    short, other = (of_seconds(topic, 300, "true_heading_deg") for topic in ("ins", "ins.2"))
    long, longest = (
        of_seconds(topic, seconds, "true_heading_deg") for topic, seconds in (("ins.3", 900), ("ins.4", 910))
    )
    need = replace(STRAIGHT, ins=replace(HEADING, takes_longest=True))
    assert choose_pair(flight_with(short, other, long, longest, GNSS), need).ins == "ins.3"
    assert choose_pair(flight_with(short, other, GNSS), need).ins == "ins"
    assert choose_pair(flight_with(short, other, long, GNSS), STRAIGHT).ins == "ins"


@pytest.mark.parametrize(
    ("named", "why"),
    [
        (("ins.3", ""), "no topic ins.3"),
        (("", "gnss.2"), "no topic gnss.2"),
        (("gnss", ""), "no INS heading in gnss"),
        (("", "ins"), "no GNSS velocity in ins"),
    ],
)
def test_a_topic_that_is_named_must_serve(named: tuple[str, str], why: str) -> None:
    flight = flight_with(of_seconds("ins", 9, "true_heading_deg"), GNSS)
    assert choose_pair(flight, STRAIGHT, "ins", "gnss") == ("ins", "gnss")
    with pytest.raises(NotAssessableError, match=f"heading: {why}$"):
        choose_pair(flight, STRAIGHT, *named)


def test_what_a_flight_makes_once_is_made_once_and_anew_for_another_flight() -> None:
    made: list[Flight] = []
    flight = flight_with(GNSS)
    assert [flight.once("x", lambda one: made.append(one) or len(made)) for _ in range(3)] == [1, 1, 1]
    assert replace(flight, source_name="b").once("x", lambda one: made.append(one) or len(made)) == 2
    assert flight.without("truth") == replace(flight)


@pytest.mark.parametrize(
    ("columns", "why"),
    [
        ({"satellites_used": Column(np.zeros(926))}, "GNSS never had a fix: 926 rows, 0 satellites"),
        ({"satellites_used": Column(np.array([0.0, 3.0]))}, "GNSS never had a fix: 2 rows, at most 3 satellites"),
        ({"fix": Column(np.array(["none"]))}, "GNSS never had a fix: 1 row"),
        ({"satellites_used": Column(np.ones(1)), "latitude_deg": Column(np.ones(1))}, "no GNSS velocity in the log"),
        ({"track_deg": Column(np.ones(3))}, "no GNSS velocity in the log"),
    ],
)
def test_reasons(columns: dict[str, Column], why: str) -> None:
    assert why_without_gnss(flight_of(**columns), "velocity") == why
    assert why_without_gnss(Flight({}), "position") == "no GNSS position in the log"


def test_a_log_without_a_fix_says_so_where_the_heading_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "log.ubx"
    seconds = [f"2026-05-04T12:{at // 60:02d}:{at % 60:02d}Z" for at in range(100)]
    path.write_bytes(
        b"".join(
            pvt(utc, fixType=0, flags=0, numSV=0) + ubx("NAV-ATT", iTOW=week_ms(utc), heading=9_000_000, accHeading=1)
            for utc in seconds
        )
    )
    with pytest.raises(NotAssessableError, match="GNSS never had a fix: 100 rows, 0 satellites"):
        groundstation.open(path).heading()
