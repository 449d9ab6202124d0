"""The ledger's figures, its findings, and records in order."""

import json

import numpy as np
import pytest

from groundstation.base.records import Column, Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.base.serial import to_json_exactly
from groundstation.base.units import NS_PER_S
from groundstation.integrity import corrected, ledger_findings, survey, thresholds_from
from groundstation.integrity.ledger import gaps_of
from groundstation.integrity.ordering import joined


def batch(topic: str, times_s: list[float], first_record: int = 0, **columns: Column) -> RecordBatch:
    times = np.round(np.array(times_s) * NS_PER_S).astype(np.int64)
    index = np.arange(first_record, first_record + len(times), dtype=np.int64)
    return RecordBatch(topic, index, Column(times), columns)


def test_rates_coverage_and_gaps() -> None:
    times = [0.0, 0.1, 0.2, 0.3, 0.4, 1.0, 1.1, 1.2, 3.2, 3.3]
    ledger = survey([LogHeader("t"), batch("ins", times)]).ledger["ins"]
    assert ledger.rows == 10 and ledger.span_s == 3.3
    assert ledger.nominal_rate_hz == pytest.approx(10.0) and ledger.actual_rate_hz == pytest.approx(9 / 3.3)
    assert ledger.coverage == pytest.approx(10 / 34)
    assert ledger.gaps.start_ns.tolist() == [400_000_000, 1_200_000_000]
    assert ledger.gaps.length_s.tolist() == pytest.approx([0.6, 2.0])


def test_the_definition_of_a_gap_can_be_set() -> None:
    items: list[Item] = [LogHeader("t"), batch("ins", [0.0, 0.1, 0.2, 0.45, 0.55, 1.55, 1.65])]
    for settings, count in (
        ({}, 1),
        ({"periods": 2.0}, 2),
        ({"periods": 2.0, "min_s": 0.5}, 1),
        ({"periods": 20.0}, 0),
    ):
        found = survey(items, thresholds=thresholds_from({"version": 1, "gaps": settings}))
        assert len(found.ledger["ins"].gaps) == count
        assert sum(len(gaps) for gaps in found.gaps) == count


def test_events_have_no_gaps() -> None:
    ledger = survey([LogHeader("t"), batch("event", [0, 1, 2, 900])]).ledger["event"]
    assert len(ledger.gaps) == 0 and ledger.coverage is None
    assert len(gaps_of("event", np.array([0, 1, 9]) * NS_PER_S)) == 0


def test_values_outside_the_range_and_nan_are_counted() -> None:
    latitude = Column(np.array([10.0, 912.0, np.nan, -91.0, 912.0]), np.array([True, True, True, True, False]))
    speed = Column(np.array([1.0, np.inf, 3.0, 4.0, 5.0]))
    items = [LogHeader("t"), batch("gnss", [0, 1, 2, 3, 4], 7, latitude_deg=latitude, pdop=speed)]
    found = survey(items).ledger
    fields = {field.name: field for field in found["gnss"].fields}
    assert (fields["latitude_deg"].present, fields["latitude_deg"].nan) == (4, 1)
    assert (fields["latitude_deg"].out_of_range, fields["latitude_deg"].first_out_of_range) == (2, 8)
    assert fields["pdop"].out_of_range == 1
    texts = {finding.code: finding.text for finding in ledger_findings(found) if "latitude" in finding.text}
    assert "2 values outside [-90, 90], first at record 8" in texts["values.out_of_range"]
    assert "NaN, as the device wrote it, in 1 of 4 values" in texts["values.nan"]


@pytest.mark.parametrize(
    ("topic", "counting", "severity"), [("ins", False, "warn"), ("raw.a", False, "info"), ("ins", True, "info")]
)
def test_a_clock_that_stands_still_is_a_warning(topic: str, counting: bool, severity: str) -> None:
    found = survey([LogHeader("t", has_counting_clock=counting), batch(topic, [7.0] * 30 + [8.0])])
    (finding,) = [finding for finding in ledger_findings(found.ledger) if finding.code == "time.duplicates"]
    assert (finding.severity, finding.count) == (severity, 29)
    assert ("stands still" in finding.text) == (severity == "warn")


def test_damages_and_remarks_reach_the_findings() -> None:
    items: list[Item] = [
        LogHeader("t"),
        batch("ins", [0, 1, 2]),
        Damage("dropped_rows", "row 7", 1, "rows with fewer cells", "ins"),
        Damage("repeated_header", "row 9", 1, "header lines", loses_data=False),
        Remark("assumed_utc", "3 times without a zone"),
        Remark("derived", "velocities", "gnss"),
        Remark("unreadable_metadata", "reference.parking_heading_deg: 'abc'"),
    ]
    found = survey(items)
    assert found.ledger.loses_data and len(found.damages) == 2 and len(found.remarks) == 3
    codes = {finding.code: finding.severity for finding in ledger_findings(found.ledger)}
    assert codes["data.dropped_rows"] == "warn" and codes["data.repeated_header"] == "info"
    assert codes["reader.assumed_utc"] == codes["reader.unreadable_metadata"] == "warn"
    assert codes["reader.derived"] == "info"


def test_dictionaries_are_json_and_repeat_exactly() -> None:
    items = [
        LogHeader("t"),
        batch("ins", [0, 0.1, 0.2, 5.0], roll_deg=Column(np.zeros(4))),
        batch("baro", [0, 1, 2, 3]),
    ]
    first, second = (survey(list(items)) for _ in range(2))
    text = json.dumps(to_json_exactly(first.ledger.document()), allow_nan=False)
    assert text == json.dumps(to_json_exactly(second.ledger.document()), allow_nan=False)
    assert json.dumps(to_json_exactly(first.clock.document()), allow_nan=False)
    assert list(json.loads(text)["topics"]) == ["baro", "ins"] and first.ledger.completeness["baro"] == 1.0
    with pytest.raises(KeyError):
        first.ledger["gnss"]


def test_an_empty_log() -> None:
    found = survey([LogHeader("t")])
    assert found.ledger.topics == () and list(corrected([LogHeader("t")], found.clock)) == []
    assert [finding.code for finding in ledger_findings(found.ledger)] == ["data.none"]


def test_held_back_records_come_in_order_and_in_bounded_pieces() -> None:
    times = [0.0, 1, 2, 3, 5, 6, 4, 7, 8, 9, 10, 11]
    pieces = [
        batch("ins", times[start : start + 3], start, x=Column(np.array(times[start : start + 3])))
        for start in (0, 3, 6, 9)
    ]
    items: list[Item] = [LogHeader("t"), *pieces]
    clock = survey(items).clock
    assert clock.lateness_ns == {"ins": 2 * NS_PER_S}
    out = list(corrected(items, clock))
    assert [value for piece in out for value in piece.columns["x"].values] == sorted(times)
    assert out[0].record_index.tolist() == [0] and max(len(piece) for piece in out) <= 5
    assert all(piece.time_ns is not None for piece in out)


def test_a_topic_of_one_batch_comes_whole_where_tables_are_made() -> None:
    items: list[Item] = [LogHeader("t"), batch("ins", [0, 1, 3, 2, 4]), batch("gnss", [0, 1, 2], 5)]
    clock = survey(items).clock
    assert [len(piece) for piece in corrected(items, clock) if piece.topic == "ins"] == [4, 1]
    gnss, ins = corrected(items, clock, for_tables=True)
    assert (gnss.topic, len(gnss)) == ("gnss", 3)
    assert ins.record_index.tolist() == [0, 1, 3, 2, 4]


@pytest.mark.parametrize("pieces", [1, 3, 9])
def test_tables_get_the_rows_of_a_stream(pieces: int) -> None:
    times = np.arange(27) + np.tile([0, 3, 0, -2, 0, 0, 1, 0, 0], 3)
    several = np.array_split(times, pieces)
    firsts = np.cumsum([0, *map(len, several[:-1])]).tolist()
    given = [batch("ins", some.tolist(), first) for some, first in zip(several, firsts, strict=True)]
    items: list[Item] = [LogHeader("t"), *given]
    clock = survey(items).clock
    streamed, whole = (joined(list(corrected(items, clock, for_tables=is_for))) for is_for in (False, True))
    assert np.array_equal(streamed.record_index, whole.record_index)
    assert whole.time_ns is not None and (np.diff(whole.time_ns) >= 0).all()


def test_equal_times_keep_the_order_of_the_source() -> None:
    items: list[Item] = [LogHeader("t"), batch("ins", [0, 1, 1, 1, 3, 4, 2, 5, 6])]
    (out,) = (piece for piece in [joined(list(corrected(items, survey(items).clock)))])
    assert out.record_index.tolist() == [0, 1, 2, 3, 6, 4, 5, 7, 8]


def test_joining_batches_of_different_fields_and_widths() -> None:
    one = batch("event", [0, 1], name=Column(np.array(["a", "b"])))
    two = batch("event", [2], 2, name=Column(np.array(["long"])), extra=Column(np.array([1.0])))
    items: list[Item] = [LogHeader("t"), one, two]
    whole = joined(list(corrected(items, survey(items).clock)))
    assert whole.columns["name"].values.tolist() == ["a", "b", "long"]
    assert whole.columns["extra"].mask.tolist() == [False, False, True]


def test_topics_of_different_records_share_one_clock() -> None:
    step = [*range(100, 110), *range(50, 80)]
    ins = batch("ins", step)
    gnss = ins.take(np.arange(20, 40))  # begins after the step; not moved
    found = survey([LogHeader("t"), ins, RecordBatch("gnss", gnss.record_index, gnss.device_time_ns, {})])
    assert found.ledger["ins"].first_ns == 40 * NS_PER_S and found.ledger["gnss"].first_ns == 60 * NS_PER_S
    assert found.ledger["ins"].backward_steps == 1 and found.ledger["gnss"].backward_steps == 0


def log_of(**others: list[float]) -> list[Item]:
    """Make a log of 100 s with an INS at 10 Hz and other topics at the times given, recorded in order of time."""
    topics = {"ins": np.arange(0.0, 100.0, 0.1).tolist(), **{f"raw.{name}": times for name, times in others.items()}}
    place = np.argsort(np.argsort(np.concatenate(list(topics.values())), kind="stable"))
    items: list[Item] = [LogHeader("t")]
    at = 0
    for topic, times_s in topics.items():
        index = place[at : at + len(times_s)].astype(np.int64)
        items.append(RecordBatch(topic, index, batch(topic, times_s).device_time_ns, {}))
        at += len(times_s)
    return items


@pytest.mark.parametrize(
    "times_s",
    [
        [0.5 + 1e-5 * row for row in range(15)],  # MULT: 15 units within 0.2 ms
        [0.5 + 1e-5 * row for row in range(70)] + [55.0 + 1e-5 * row for row in range(70)],  # FMTU: two bursts
        [0.5 + 0.01 * row for row in range(300)],  # FILE: files written in the first 3.5 s
    ],
)
def test_lists_written_once_have_no_rate_and_lose_nothing(times_s: list[float]) -> None:
    found = survey(log_of(MULT=times_s)).ledger
    assert not found.damages and not len(found["raw.MULT"].gaps)
    assert not [one for one in ledger_findings(found) if one.code in ("data.breaks_off", "data.gaps")]


def test_a_burst_is_no_rate_but_a_stream_that_stops_is_told() -> None:
    found = survey(log_of(MULT=[0.5 + 1e-5 * row for row in range(15)], TECS=[0.1 * row for row in range(500)])).ledger
    assert found["raw.MULT"].nominal_rate_hz is None and found["raw.MULT"].coverage is None
    assert found["raw.TECS"].nominal_rate_hz == pytest.approx(10.0)
    (ends,) = found.damages
    assert (ends.topic, ends.kind, ends.count, ends.loses_data) == ("raw.TECS", "breaks_off", 500, False)
