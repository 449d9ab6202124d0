"""run --store delta: rows of flights in a Delta table, merged by flight id, whoever else writes into it."""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from groundstation.base.errors import UsageError
from groundstation.pipeline.many_flights.fleet.delta_sink import DIGEST, delta_place, put_flights
from groundstation.pipeline.many_flights.fleet.refresh import refresh
from groundstation.pipeline.many_flights.fleet.scan import Scan
from groundstation.pipeline.many_flights.fleet.table import fleet_parquet
from groundstation.pipeline.one_flight.outcome import Outcome
from tests.fleet_example import save_flight
from tests.test_remote import bucket

__all__ = ["bucket"]

deltalake = pytest.importorskip("deltalake")


def kept(place: Path) -> pa.Table:
    return pa.table(deltalake.DeltaTable(str(place)).to_pyarrow_table()).sort_by("flight_id")


def outcomes(found: Scan) -> list[Outcome]:
    return [Outcome("a.ulg", "done", "", flight_id=name) for name in found.names]


def test_the_same_run_twice_adds_nothing_and_another_one_replaces_its_rows(tmp_path: Path) -> None:
    out, place = tmp_path / "out", tmp_path / "table"
    folders = [save_flight(out, number, aircraft=f"A{number}") for number in range(3)]
    store, (found, _) = f"delta:{place}", refresh(out)
    assert put_flights(store, found, outcomes(found)) == ()
    first = kept(place)
    rows = pq.read_table(pa.BufferReader(fleet_parquet(found.table())))
    assert first["flight_id"].to_pylist() == [folder.name for folder in folders]
    assert first.column_names == [*rows.column_names, DIGEST]
    for name in ("error_deg", "aircraft", "samples", "has_lost_data", "forecast_method"):
        assert first[name].to_pylist() == rows[name].to_pylist()
    assert first["start_utc"].cast(pa.int64()).to_pylist() == [
        one // 1000 for one in rows["start_utc"].cast(pa.int64()).to_pylist()
    ]
    files = set(deltalake.DeltaTable(str(place)).file_uris())
    assert put_flights(store, found, outcomes(found)) == ()
    assert set(deltalake.DeltaTable(str(place)).file_uris()) == files
    save_flight(out, 1, aircraft="A1", error_deg=3.0)
    found, _ = refresh(out)
    assert put_flights(store, found, outcomes(found)[1:2]) == ()
    again = kept(place)
    assert len(again) == 3 and again["error_deg"].to_pylist()[1] == 3.0
    assert again.take([0, 2]).equals(first.take([0, 2]))


def test_several_writers_lose_nothing(tmp_path: Path) -> None:
    place = tmp_path / "table"
    founds = []
    for writer in range(3):
        save_flight(tmp_path / f"out{writer}", writer)
        save_flight(tmp_path / f"out{writer}", 9)  # each of them has this one
        founds.append(refresh(tmp_path / f"out{writer}")[0])
    with ThreadPoolExecutor(3) as pool:
        told = list(pool.map(lambda found: put_flights(f"delta:{place}", found, outcomes(found)), founds))
    assert told == [(), (), ()]
    assert kept(place)["flight_id"].to_pylist() == sorted({name for found in founds for name in found.names})


@pytest.mark.slow
def test_several_writers_lose_nothing_in_a_bucket(bucket: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_ALLOW_HTTP", "true")  # the server on this machine has no certificate
    place, founds = f"{bucket}/table", []
    for writer in range(3):
        save_flight(tmp_path / f"out{writer}", writer)
        save_flight(tmp_path / f"out{writer}", 9)
        founds.append(refresh(tmp_path / f"out{writer}")[0])
    with ThreadPoolExecutor(3) as pool:
        told = list(pool.map(lambda found: put_flights(f"delta:{place}", found, outcomes(found)), founds))
    assert told == [(), (), ()]
    table = deltalake.DeltaTable(place)
    flights = pa.table(table.to_pyarrow_table())["flight_id"].to_pylist()
    assert sorted(flights) == sorted({name for found in founds for name in found.names})
    files = set(table.file_uris())
    assert put_flights(f"delta:{place}", founds[0], outcomes(founds[0])) == ()
    assert set(deltalake.DeltaTable(place).file_uris()) == files


def test_what_is_wrong_is_told_in_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_flight(tmp_path / "out", 0)
    found, _ = refresh(tmp_path / "out")
    (tmp_path / "file").write_text("of somebody")
    (problem,) = put_flights(f"delta:{tmp_path / 'file'}", found, outcomes(found))
    assert problem.state == "failed" and "file: not written" in problem.text and "\n" not in problem.text
    with pytest.raises(UsageError, match="delta:PATH or delta:URL"):
        delta_place("iceberg:there")
    monkeypatch.setitem(sys.modules, "deltalake", None)
    with pytest.raises(UsageError, match=r"no package deltalake.+groundstation\[delta\]"):
        delta_place("delta:there")
