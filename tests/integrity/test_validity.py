"""Rates and gaps are those of the times at which values were valid; a clock that another one corrects is corrected."""

import numpy as np
import pytest

from groundstation.base.records import Column, Item, LogHeader, RecordBatch
from groundstation.integrity import corrected, places, survey

NS = 10**9
ROWS = 200
UTC_NS = 1_777_874_400 * NS


def in_bursts(offset_ns: int = 0) -> RecordBatch:
    """Ten samples a second, written once in two seconds; the first second of the log twice as late."""
    valid_ns = UTC_NS + np.arange(ROWS) * NS // 10
    written_ns = UTC_NS + (np.arange(ROWS) // 20 + 1) * 2 * NS + np.arange(ROWS) % 20 * 1_000_000
    index, columns = np.arange(ROWS), {"roll_deg": Column(np.arange(ROWS, dtype=np.float64))}
    return RecordBatch("ins", index, Column(written_ns), columns, validity_time_ns=valid_ns + offset_ns)


@pytest.mark.parametrize("memory_bytes", [1 << 24, 100])
def test_rates_and_gaps_are_those_of_the_values(memory_bytes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(places, "MEMORY_BYTES", memory_bytes)
    items: list[Item] = [LogHeader("t", utc_of_zero_ns=0, has_counting_clock=True), in_bursts()]
    ledger = survey(items).ledger["ins"]
    assert ledger.nominal_rate_hz == pytest.approx(10.0) and ledger.coverage == 1.0 and not len(ledger.gaps)
    assert ledger.first_ns == UTC_NS and ledger.span_s == pytest.approx(19.9)
    late: list[Item] = [items[0], RecordBatch("ins", *(in_bursts().record_index, in_bursts().device_time_ns), {})]
    assert len(survey(late).ledger["ins"].gaps) == 9, "as they were written"


def test_offsets_of_the_header_move_times_of_both_kinds() -> None:
    """The device's clock was set by ten years and more after 50 records; what is valid when is told by another."""
    step_ns, first = 400_000_000 * NS, 50
    batch = in_bursts()
    moved_ns = np.where(batch.record_index < first, step_ns, 0)
    assert batch.validity_time_ns is not None
    read = RecordBatch(
        "ins",
        batch.record_index,
        Column(batch.device_time_ns.values - moved_ns),
        batch.columns,
        validity_time_ns=batch.validity_time_ns - moved_ns,
    )
    offsets = ((0, step_ns), (first, 0))
    for is_counting in (True, False):
        header = LogHeader("t", utc_of_zero_ns=0, has_counting_clock=is_counting, clock_offsets=offsets)
        found = survey([header, read])
        assert not found.clock.steps and found.clock.is_absolute
        assert found.clock.first_device_ns == UTC_NS + 2 * NS - step_ns, "as the device wrote it"
        (out,) = corrected([header, read], found.clock)
        assert out.time_ns is not None and out.validity_time_ns is not None
        assert (out.time_ns == batch.device_time_ns.values).all()
        assert (out.validity_time_ns == batch.validity_time_ns).all()
        assert (out.device_time_ns.values == read.device_time_ns.values).all(), "as read"
        assert found.ledger["ins"].nominal_rate_hz == pytest.approx(10.0)


def test_a_record_with_a_wrong_time_is_valid_when_its_values_were() -> None:
    batch = in_bursts()
    device_ns = batch.device_time_ns.values.copy()
    device_ns[[70, 71]] = 0
    header = LogHeader("t", utc_of_zero_ns=0, has_counting_clock=True)
    validity_ns = batch.validity_time_ns
    read = RecordBatch("ins", batch.record_index, Column(device_ns), batch.columns, validity_time_ns=validity_ns)
    (out,) = corrected([header, read], survey([header, read]).clock)
    assert out.validity_time_ns is not None and validity_ns is not None
    assert (np.sort(out.validity_time_ns) == validity_ns).all()
    assert out.time_ns is not None and out.time_ns.min() > UTC_NS, "placed by its neighbours"
