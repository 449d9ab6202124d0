"""Why GNSS does not serve: a receiver that never had a fix is told as such, with its rows and satellites."""

from pathlib import Path

import numpy as np
import pytest

import groundstation
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.tables.sources import why_without_gnss
from groundstation.tables.table import Flight, Table
from tests.receiver_writer import pvt, ubx, week_ms


def flight_of(**columns: Column) -> Flight:
    places = np.arange(len(next(iter(columns.values()))), dtype=np.int64)
    return Flight({"gnss": Table("gnss", places, columns, places, Column(places))})


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
