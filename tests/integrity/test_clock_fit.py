"""One clock by another: how often the interval holds the truth, what is seen and what is not, and hostile readings."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.clock import Clock
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import Column, LogHeader, RecordBatch
from groundstation.base.serial import from_json, to_json_exactly
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.integrity import ledger_findings, survey
from groundstation.integrity.clock_fit import Fitted, fit_relation
from groundstation.integrity.clock_references import MOST_SAMPLES
from groundstation.integrity.clock_relation import ClockRelation, ClockSegment

FloatArray = NDArray[np.float64]
UTC_NS = iso_to_utc_ns("2026-05-04T06:00:00Z")[0]
RUNS = 400  # seeds 0 to 399 of each kind of noise
COVERAGE = (0.915, 0.985)  # 0.95 +- 3 binomial standard errors of 400 runs (0.011), rounded outwards
SLOW_COVERAGE = 0.90  # at least, where noise is correlated over a tenth of the log: what blocks can tell of it


def late(rng: np.random.Generator, count: int, step_s: float, sigma_s: float, memory_s: float) -> FloatArray:
    """Lateness of messages: normal, correlated over ``memory_s`` (first-order Gauss-Markov)."""
    kept = np.exp(-step_s / memory_s) if memory_s else 0.0
    noise = rng.standard_normal(count)
    noise[1:] *= np.sqrt(1.0 - kept * kept)
    for place in range(1, count):
        noise[place] += kept * noise[place - 1]
    return sigma_s * noise


def fitted(true_s: FloatArray, recorder_s: FloatArray, **settings: float) -> Fitted:
    order = np.argsort(recorder_s)
    time_ns = np.rint((10.0 + recorder_s[order]) * NS_PER_S).astype(np.int64)
    reference_ns = UTC_NS + np.rint(true_s[order] * NS_PER_S).astype(np.int64)
    return fit_relation(time_ns, reference_ns, **{"step_s": 0.25, "observable_ppm": 1e4, **settings})


@pytest.mark.parametrize(
    ("count", "step_s", "sigma_s", "memory_s", "drift_ppm"),
    [
        (750, 0.8, 0.005, 0.0, 50.0),
        pytest.param(750, 0.8, 0.005, 2.0, 50.0, marks=pytest.mark.slow),
        pytest.param(600, 1.0, 0.02, 5.0, -12.0, marks=pytest.mark.slow),
        (600, 1.0, 0.02, 20.0, -12.0),
        (100, 1.0, 0.005, 0.0, 0.0),
        (40, 1.0, 0.001, 0.0, 5.0),
        (15, 2.0, 0.0005, 0.0, 20.0),
    ],
)
def test_the_interval_holds_the_truth_in_95_of_100_logs(
    count: int, step_s: float, sigma_s: float, memory_s: float, drift_ppm: float
) -> None:
    share, breaks = coverage(count, step_s, sigma_s, memory_s, drift_ppm)
    assert COVERAGE[0] <= share <= COVERAGE[1]
    assert breaks <= 0.01 * RUNS  # false alarms


def test_slow_noise_widens_the_interval() -> None:
    share, breaks = coverage(600, 1.0, 0.02, 60.0, 20.0)
    assert SLOW_COVERAGE <= share <= COVERAGE[1]
    assert breaks <= 0.02 * RUNS


def coverage(count: int, step_s: float, sigma_s: float, memory_s: float, drift_ppm: float) -> tuple[float, int]:
    """Share of logs whose drift is held by its interval, and the false breaks in all of them."""
    true_s = np.arange(count) * step_s
    hits = breaks = 0
    for seed in range(RUNS):
        recorder_s = true_s * (1.0 + drift_ppm * 1e-6)
        recorder_s = recorder_s + late(np.random.default_rng(seed), count, step_s, sigma_s, memory_s)
        found = fitted(true_s, recorder_s)
        breaks += len(found.breaks)
        drift, sigma = found.segments[0].drift_ppm, found.segments[0].drift_sigma_ppm
        assert drift is not None and sigma is not None
        hits += abs(drift - drift_ppm) < NORMAL_95 * sigma
    return hits / RUNS, breaks


def test_a_fast_recorder_has_a_positive_drift_and_offset_is_what_to_add() -> None:
    true_s = np.arange(0.0, 200.0)
    (segment,) = fitted(true_s, true_s * 1.001 + 3.0).segments
    assert segment.drift_ppm == pytest.approx(1000.0, abs=1e-3)
    middle_s = (segment.start_ns + segment.end_ns) / 2 / NS_PER_S - 13.0  # counted by the recorder
    assert (segment.offset_ns - UTC_NS) / NS_PER_S == pytest.approx(middle_s / 1.001 - middle_s - 13.0, abs=1e-6)


@pytest.mark.parametrize("change_ppm", [50.0, 200.0])
def test_a_change_of_rate_is_placed_within_its_error(change_ppm: float) -> None:
    true_s, runs = np.arange(0.0, 600.0, 0.4), 40  # seeds 0 to 39
    errors, changes = [], []
    for seed in range(runs):
        recorder_s = true_s + np.maximum(true_s - 250.0, 0.0) * change_ppm * 1e-6
        found = fitted(true_s, recorder_s + late(np.random.default_rng(seed), len(true_s), 0.4, 0.003, 0.0))
        (one,) = found.breaks
        assert one.kind == "rate" and one.drift_change_ppm is not None
        at_s = one.time_ns / NS_PER_S - 10.0
        errors.append((at_s - 250.0) / one.time_sigma_s)
        sigma = np.hypot(*(segment.drift_sigma_ppm or 0.0 for segment in found.segments))
        changes.append((one.drift_change_ppm - change_ppm) / sigma)
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.5
    assert np.mean(np.abs(changes) < NORMAL_95) > 0.85


def test_steps_and_changes_of_rate_together() -> None:
    true_s = np.arange(0.0, 1200.0, 0.5)
    recorder_s = true_s + np.where(true_s >= 300.0, 2.0, 0.0) + np.maximum(true_s - 700.0, 0.0) * 3e-4
    recorder_s += late(np.random.default_rng(1), len(true_s), 0.5, 0.003, 1.0)
    found = fitted(true_s, recorder_s)
    assert [one.kind for one in found.breaks] == ["step", "rate"]
    assert found.breaks[0].step_s == pytest.approx(-2.0, abs=4 * found.breaks[0].step_sigma_s)
    assert found.breaks[1].drift_change_ppm == pytest.approx(300.0, abs=15.0)


def test_pieces_with_one_rate_meet_nowhere_and_are_told_all_the_same() -> None:
    """More steps than are told: the rest is cut where rates change, and the pieces beside a cut can have one rate."""
    true_ns = np.arange(2000) * 50_000_000
    reference_ns = true_ns.copy()
    reference_ns[1000:] -= NS_PER_S
    reference_ns = UTC_NS + reference_ns // NS_PER_S * NS_PER_S
    found = fit_relation(true_ns, reference_ns, step_s=0.25, observable_ppm=100.0, bound_s=0.001)
    assert all(np.isfinite([one.time_ns, one.time_sigma_s, one.step_s]).all() for one in found.breaks)
    assert {one.kind for one in found.breaks} == {"step", "rate"}


def test_late_messages_and_single_wild_readings_are_no_steps() -> None:
    true_s, rng = np.arange(0.0, 600.0, 0.5), np.random.default_rng(2)
    recorder_s = true_s + np.where(rng.random(len(true_s)) < 0.1, rng.exponential(0.5, len(true_s)), 0.0)
    told_s = true_s.copy()
    told_s[[50, 51, 700]] -= 6e8
    found = fitted(told_s, recorder_s)
    assert not found.breaks and abs(found.segments[0].drift_ppm or 0.0) < 2.0


def batches(told: NDArray[Any], every_s: float, field: str = "gnss_time_utc_s", **more: Any) -> list[Any]:
    """A table whose recorder counts rows exactly, in two batches."""
    index = np.arange(len(told))
    device = Column(np.rint(index * every_s * NS_PER_S).astype(np.int64))
    columns = {field: Column(told), **{name: Column(values) for name, values in more.items()}}
    whole = RecordBatch("raw.csv", index, device, columns)
    return [LogHeader("test"), whole.take(slice(0, len(told) // 2)), whole.take(slice(len(told) // 2, None))]


def relation_of(*arguments: Any, **more: Any) -> ClockRelation:
    (relation,) = survey(batches(*arguments, **more)).clock.relations
    return relation


def drift_of(relation: ClockRelation) -> ClockSegment:
    (segment,) = relation.segments
    return segment


def test_whole_seconds_at_one_row_a_second_tell_no_drift_of_a_short_log() -> None:
    true_s = np.arange(600.0) * (1.0 + 20e-6)
    relation = relation_of(UTC_NS / NS_PER_S + np.floor(true_s + 0.5), 1.0)
    segment = drift_of(relation)
    assert segment.drift_ppm is None and segment.drift_sigma_ppm == pytest.approx(1e6 / 600 / 3**0.5, rel=0.01)
    assert relation.drift_text(segment).startswith("not observable to better than ± ")
    assert "rounded to 1.0 s" in relation.drift_text(segment)


def test_whole_seconds_of_ten_rows_a_second_tell_the_drift_of_a_long_log() -> None:
    true_s = np.arange(0.0, 7200.0, 0.1) * (1.0 - 80e-6)
    segment = drift_of(relation_of(UTC_NS / NS_PER_S + np.floor(true_s + 0.03), 0.1))
    assert segment.drift_ppm is not None and segment.drift_sigma_ppm is not None
    assert abs(segment.drift_ppm - 80.0) < 4.0 * segment.drift_sigma_ppm < 60.0
    assert segment.samples <= MOST_SAMPLES


def test_time_of_day_passes_midnight() -> None:
    second = 86_390.003 + np.arange(0.0, 300.0, 0.5)
    relation = relation_of(second % 86_400.0, 0.5, "gnss_time_of_day_s")
    assert not relation.breaks and drift_of(relation).drift_ppm == pytest.approx(0.0, abs=1e-3)


def test_week_and_seconds_of_it() -> None:
    second = 604_700.0 + np.arange(0.0, 300.0, 0.5)
    week = 2416.0 + (second >= 604_800.0)
    relation = relation_of(second % 604_800.0, 0.5, "gnss_time_of_week_s", gnss_week=week)
    assert not relation.breaks
    assert relation.offset_text(drift_of(relation), has_utc=False).startswith("zero at 2026-05-02T23:58:02.")


def test_the_clock_of_an_ins_runs_from_its_own_zero() -> None:
    relation = relation_of(500.0 + np.arange(0.0, 300.0, 0.1) * (1.0 + 30e-6), 0.1, "ins_time_s")
    assert relation.clock == "ins" and not relation.is_utc and not relation.mistakes
    assert drift_of(relation).drift_ppm == pytest.approx(-30.0, abs=1.0)
    assert drift_of(relation).offset_ns / NS_PER_S == pytest.approx(500.0045, abs=1e-3)


def test_iso_texts_are_read_and_others_left_out() -> None:
    texts = np.array([f"2026-05-04T06:{row // 60:02d}:{row % 60:02d}.25Z" for row in range(120)])
    texts[7], texts[9] = "soon", ""
    relation = relation_of(texts, 1.0, "time_utc")
    assert relation.samples == 118
    assert relation.offset_text(drift_of(relation), has_utc=False).startswith("zero at 2026-05-04T06:00:00.250Z")


def test_rows_without_a_time_do_not_hide_that_times_are_told_several_times() -> None:
    """Whole seconds at 10 Hz: the first reading of each may be 0.1 s old, whatever stands between them."""
    told = UTC_NS / NS_PER_S + np.floor(np.arange(0.0, 300.0, 0.1))
    sigma_s = drift_of(relation_of(told, 0.1)).offset_sigma_s
    told[np.arange(len(told)) % 10 > 3] = np.nan
    assert sigma_s > 0.1 / 12**0.5
    assert drift_of(relation_of(told, 0.1)).offset_sigma_s > 0.1 / 12**0.5


def test_a_clock_that_stays_at_1970_is_no_rolled_over_week_and_gives_no_date() -> None:
    found = survey(batches(1.0 + np.arange(600.0), 1.0))
    (relation,) = found.clock.relations
    assert relation.segments and not relation.mistakes
    assert [one.text for one in ledger_findings(found.ledger) if "start_utc" in one.text] == []
    assert relation_of(np.full(100, np.nan), 1.0).reason == "no plausible reading"


HUGE, TINY = 1.7e308, 5e-324


@pytest.mark.parametrize(
    "told",
    [
        np.zeros(0),
        np.full(1, 1e9),
        np.full(100, np.nan),
        np.full(100, np.inf),
        np.full(100, 1e9),
        np.full(100, -1e9),
        np.array([HUGE, -HUGE, TINY, np.nan, 1e9, 4e9, 0.0, -1.0] * 30),
        np.arange(100) * 4.6e7,
        np.arange(100)[::-1] * 1e7,
        np.array([0, 2**64 - 1, 2**63, 2**62] * 20, dtype=np.uint64),
        np.array([np.iinfo(np.int64).min, np.iinfo(np.int64).max, 5] * 30),
        np.random.default_rng(3).uniform(0, 4e9, 500),
        np.array(["x"] * 50),
    ],
    ids=lambda told: f"{told.dtype}-{len(told)}-{told[:1]}",
)
@pytest.mark.parametrize("field", ["gnss_time_utc_s", "ins_time_s", "gnss_time_of_day_s"])
def test_hostile_readings_give_an_answer_or_a_reason(told: NDArray[Any], field: str) -> None:
    found = survey(batches(told, 0.1, field))
    for relation in found.clock.relations:
        assert relation.segments or relation.reason
        assert all("\n" not in relation.drift_text(one) for one in relation.segments)
    assert all("\n" not in finding.text for finding in ledger_findings(found.ledger))
    kept = found.clock.document()
    assert from_json(Clock, to_json_exactly(kept)) == kept


def test_recorder_times_at_both_ends_of_64_bits() -> None:
    index = np.arange(60)
    ends = np.where(index < 30, index, 2**62 + index) * 2 - (index >= 30)
    told = Column(np.linspace(1.0, 4.5e9, 60))
    items = [LogHeader("test"), RecordBatch("raw.csv", index, Column(ends), {"gnss_time_utc_s": told})]
    (relation,) = survey(items).clock.relations
    assert relation.segments or relation.reason
