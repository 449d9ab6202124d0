"""Tables from batches and back: fields that come and go, wider types, order, and the pandas types."""

from itertools import pairwise

import numpy as np
import pytest

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Column, RecordBatch
from groundstation.tables import growing
from groundstation.tables.assemble import batches_from_flight, flight_from_batches
from groundstation.tables.table import Flight, Table


def batch(topic: str, time_ns: list[int], first: int = 0, **columns: object) -> RecordBatch:
    index = np.arange(first, first + len(time_ns))
    arrays = {
        name: values if isinstance(values, Column) else Column(np.array(values)) for name, values in columns.items()
    }
    return RecordBatch(topic, index, Column(index * 10), arrays, np.array(time_ns, dtype=np.int64))


def gather(*batches: RecordBatch) -> Flight:
    return flight_from_batches(batches, metadata={"aircraft": "A"}, has_utc=True, source_name="a.csv")


def test_fields_that_come_and_go_are_absent_where_missing() -> None:
    flight = gather(
        batch("ins", [10, 20], roll_deg=[1.0, np.nan], mode=["nav", "nav"]),
        batch("gnss", [5], satellites_used=[7]),
        batch("ins", [30], 2, pitch_deg=[3.0], mode=["attitude"]),
    )
    ins = flight["ins"]
    assert ins.columns["roll_deg"].mask.tolist() == [True, True, False]  # the NaN that the device wrote is present
    assert ins.columns["pitch_deg"].mask.tolist() == [False, False, True]
    assert ins.columns["mode"].present is None
    assert ins.text("mode").tolist() == ["nav", "nav", "attitude"]
    assert ins.record_index.tolist() == [0, 1, 2]
    assert ins.device_time_ns.values.tolist() == [0, 10, 20]
    assert (flight.start_ns, flight.topics(), flight.metadata["aircraft"]) == (5, ("gnss", "ins"), "A")


@pytest.mark.parametrize("expected", [0, 1, 7, 50, 10**15])  # the last: a damaged count
def test_rows_that_were_expected_change_nothing(expected: int) -> None:
    types = ["i2", "u2", "f4", "i2", "f8", "u2", "i2"]
    parts = [batch("ins", [t], t, count=np.array([t], dtype=kind)) for t, kind in enumerate(types)]
    parts[3] = batch("ins", [3], 3, mode=["attitude"])
    flight = flight_from_batches(parts, metadata={}, has_utc=True, source_name="a.csv", rows={"ins": expected})
    count, mode = (flight["ins"].columns[name] for name in ("count", "mode"))
    assert count.values.dtype == np.float64 and count.values[count.mask].tolist() == [0, 1, 2, 4, 5, 6]
    assert mode.values.dtype == "U8" and flight["ins"].text("mode").tolist() == [*[""] * 3, "attitude", *[""] * 3]
    assert flight["ins"].time_ns.tolist() == flight["ins"].record_index.tolist() == [*range(7)]


def test_a_table_of_many_batches_holds_each_value_once() -> None:
    parts = [batch("ins", [t, t], t, roll_deg=[1.0, 2.0]) for t in range(2_000)]
    for rows, most in (({}, 1.15), ({"ins": 4_000}, 1.0)):
        flight = flight_from_batches(parts, metadata={}, has_utc=True, source_name="a.csv", rows=rows)
        held = flight["ins"].columns["roll_deg"].values
        while held.base is not None:
            held = held.base
        assert held.nbytes <= most * 4_000 * 8


def test_no_column_is_moved_for_a_short_first_batch_of_a_long_log(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growing, "_moved", lambda *_: pytest.fail("a column was moved"))
    ends = [0, 100, 50_000, 100_000]  # as chunks of the store come: the first is a part in a thousand
    parts = [batch("ins", list(range(*pair)), pair[0], roll_deg=np.arange(*pair) * 1e-3) for pair in pairwise(ends)]
    flight = flight_from_batches(parts, metadata={}, has_utc=True, source_name="a.csv", rows={"ins": 100_000})
    np.testing.assert_array_equal(flight["ins"].values("roll_deg"), 1e-3 * np.arange(100_000))


def test_a_place_that_is_not_on_earth_is_absent_and_raw_topics_keep_it() -> None:
    places = {
        "latitude_deg": [56.0, 95.0, -91.0, 56.0, np.nan, np.inf, -90.0],
        "longitude_deg": [38.0, 38.0, 38.0, 1e9, 38.0, 38.0, 359.0],
        "roll_deg": [1.0] * 7,
    }
    flight = gather(batch("gnss.2", list(range(7)), **places), batch("raw.gnss", list(range(7)), **places))
    for name in ("latitude_deg", "longitude_deg"):
        assert flight["gnss.2"].columns[name].mask.tolist() == [True, False, False, False, True, False, True], name
        assert flight["raw.gnss"].columns[name].present is None
    assert flight["gnss.2"].columns["roll_deg"].present is None
    alone = gather(batch("ins", [1, 2], latitude_deg=[95.0, 5.0]), batch("ins", [3, 4], 2, longitude_deg=[1.0, 400.0]))
    assert alone["ins"].columns["latitude_deg"].mask.tolist() == [False, True, False, False]
    assert alone["ins"].columns["longitude_deg"].mask.tolist() == [False, False, True, False]


def test_types_widen_to_the_common_one() -> None:
    ins = gather(
        batch("ins", [1], a=np.float32([1.5]), b=[1]),
        batch("ins", [2], a=[2.5], b=[0.5]),
        batch("ins", [3], b=[True]),
    )["ins"]
    assert ins.columns["a"].values.dtype == np.float64
    assert ins.values("a")[:2].tolist() == [1.5, 2.5]
    assert ins.values("b").tolist() == [1.0, 0.5, 1.0]


def test_order_is_by_time_of_validity_and_stable() -> None:
    late = batch("gnss", [100, 200], a=[1.0, 2.0])
    shifted = RecordBatch(
        late.topic, late.record_index, late.device_time_ns, late.columns, late.time_ns, np.array([50, 150])
    )
    gnss = gather(shifted, batch("gnss", [150, 40], 2, a=[3.0, 4.0]))["gnss"]
    assert gnss.time_ns.tolist() == [40, 50, 150, 150]
    assert gnss.values("a").tolist() == [4.0, 1.0, 2.0, 3.0]


def test_batches_without_rows_leave_no_table_and_time_is_required() -> None:
    assert gather(batch("ins", [], roll_deg=np.zeros(0))).topics() == ()
    assert gather().start_ns == 0
    untimed = RecordBatch("ins", np.arange(1), Column(np.arange(1)), {})
    with pytest.raises(GroundstationError, match=r"a.csv, ins: found records without corrected time"):
        gather(untimed)


def test_batches_of_a_flight_give_the_same_tables_again() -> None:
    rng = np.random.default_rng(1)
    time_ns = np.sort(rng.integers(0, 10**12, 1000))
    flight = gather(
        batch("ins", time_ns.tolist(), roll_deg=Column(rng.normal(size=1000), rng.random(1000) > 0.5)),
        batch("event", [10**11, 10**12 + 1], name=["a", "long name"]),
    )
    batches = list(batches_from_flight(flight, max_rows=300))
    assert [len(part) for part in batches] == [300, 2, 300, 300, 100]
    assert all(part.time_ns is not None for part in batches)
    again = gather(*batches)
    for topic in flight.topics():
        assert np.array_equal(flight[topic].time_ns, again[topic].time_ns)
        for name, column in flight[topic].columns.items():
            assert np.array_equal(column.mask, again[topic].columns[name].mask)
            assert np.array_equal(column.values[column.mask], again[topic].columns[name].values[column.mask])


def test_frame_types_depend_on_the_field_alone() -> None:
    index = np.arange(2)
    for present in (None, np.array([True, False]), np.array([False, False])):
        columns = {
            "number": Column(np.array([1.0, 2.0]), present),
            "single": Column(np.array([1.0, 2.0], dtype=np.float32), present),
            "flag": Column(np.array([True, False]), present),
            "count": Column(np.array([1, 2]), present),
            "text": Column(np.array(["a", "b"]), present),
        }
        frame = Table("x", index * 10, columns, index, Column(index)).to_frame()
        assert [str(dtype) for dtype in frame.dtypes] == ["float64", "float32", "boolean", "Int64", "string"]
        assert frame.index.tolist() == [0, 10]
        assert str(frame.index.dtype) == "int64"
        missing = 0 if present is None else int(np.count_nonzero(~present))
        assert frame.isna().sum().tolist() == [missing] * 5


def test_a_mask_that_selects_all_rows_copies_none() -> None:
    table = gather(batch("ins", [0, 1, 2], roll_deg=[1.0, 2.0, 3.0]))["ins"]
    assert table.take(np.ones(3, dtype=bool)) is table
    assert table.take(np.array([True, False, True])).values("roll_deg").tolist() == [1.0, 3.0]
    assert table.take(np.array([0, 1, 2])).values("roll_deg").tolist() == [1.0, 2.0, 3.0]


def test_an_empty_table_answers_everything() -> None:
    empty = Table.empty("ins")
    assert (len(empty), empty.values("roll_deg").shape, empty.valid("roll_deg").shape) == (0, (0,), (0,))
    assert len(empty.unique_times()) == 0
    assert empty.to_frame().shape == (0, 0)


def test_of_one_time_the_first_present_value_of_each_field_is_kept() -> None:
    first = batch("ins", [10, 20, 30], latitude_deg=[55.0, 56.0, 57.0], roll_deg=[1.0, 2.0, 3.0])
    second = batch("ins", [10, 20], first=3, velocity_north_mps=[7.0, 8.0], roll_deg=[-1.0, -2.0])
    table = gather(first, second)["ins"].unique_times()
    assert table.time_ns.tolist() == [10, 20, 30]
    assert table.values("latitude_deg").tolist() == [55.0, 56.0, 57.0]
    assert table.values("roll_deg").tolist() == [1.0, 2.0, 3.0]
    assert np.array_equal(table.values("velocity_north_mps"), [7.0, 8.0, np.nan], equal_nan=True)


def test_columns_of_a_topic_share_one_piece_of_memory() -> None:
    """The system then gives large pages for it: a long table is made with a third of the page faults."""
    ins = gather(
        batch("ins", [10, 20], roll_deg=[1.0, 2.0], samples=[1, 2], mode=["nav", "nav"]),
        batch("ins", [30, 40], 2, roll_deg=[3.0, 4.0], samples=[3, 4], mode=["off", "nav"]),
    )["ins"]
    table = flight_from_batches(
        batches_from_flight(Flight({"ins": ins}, {}, 10, True), max_rows=1),
        metadata={},
        has_utc=True,
        source_name="a.csv",
        rows={"ins": 4},
    )["ins"]
    arrays = [table.time_ns, table.record_index, table.device_time_ns.values]
    arrays += [table.columns[name].values for name in ("roll_deg", "samples", "mode")]
    places = [array.__array_interface__["data"][0] for array in arrays]
    assert table.text("mode").tolist() == ["nav", "nav", "off", "nav"]
    assert max(places) - min(places) < 6 * 64 and len(set(places)) == 6
