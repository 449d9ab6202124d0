"""UTC of a recorder's zero by a clock that is set in the log, and dates that missed a rollover of the GPS week."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.base.records import Int64Array
from groundstation.base.timescales import ROLLOVER_NS, WEEK_NS, iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.readers.rollover import CODE, Earliest, OtherDate, rollovers
from groundstation.readers.start import told_at_zero, zero_of_readings

ZERO_NS = iso_to_utc_ns("2024-05-06T10:00:00Z")[0]
JITTER_NS = 150_000_000  # of a receiver's messages
TOLERANCE_NS = JITTER_NS
DAY_S = 86_400


def readings(levels: list[tuple[int, float]], seed: int = 0, drift_ppm: float = 0.0) -> Int64Array:
    """UTC less device time of a receiver at 5 Hz: levels are (how many readings, seconds off the truth)."""
    off_s = np.concatenate([np.full(count, seconds) for count, seconds in levels])
    jitter_ns = np.random.default_rng(seed).integers(0, JITTER_NS, len(off_s))
    drift_ns = np.arange(len(off_s)) * 200 * drift_ppm
    return ZERO_NS + np.rint(off_s * 1e9).astype(np.int64) - jitter_ns - np.rint(drift_ns).astype(np.int64)


@given(
    before=st.integers(3, 400),
    after=st.integers(3, 400),
    late_s=st.integers(1, 18),
    seed=st.integers(0, 1000),
    drift_ppm=st.floats(-100.0, 100.0),
)
def test_leap_seconds_learnt_in_the_log(before: int, after: int, late_s: int, seed: int, drift_ppm: float) -> None:
    found = zero_of_readings(readings([(before, late_s), (after, 0.0)], seed, drift_ppm))
    assert abs(found.ns - ZERO_NS) <= TOLERANCE_NS + 1e9 * 0.2 * 800 * 1e-4
    (remark,) = found.remarks("GNSS time")
    assert remark.code == "leap_seconds" and f"{before} readings told UTC {late_s} s late" in remark.text


@given(
    levels=st.permutations([0, 1, 2]),
    counts=st.tuples(st.integers(3, 60), st.integers(3, 60), st.integers(3, 60)),
    weeks=st.integers(1, 2_400),
)
def test_a_late_week_is_one_of_the_past_wherever_it_stands(
    levels: list[int], counts: tuple[int, int, int], weeks: int
) -> None:
    """Of three stretches one or two are some weeks behind."""
    for behind in (levels[:1], levels[:2]):
        told = [(counts[at], -weeks * 7.0 * DAY_S if at in behind else 0.0) for at in range(3)]
        found = zero_of_readings(readings(told))
        assert abs(found.ns - ZERO_NS) <= TOLERANCE_NS
        remarks = list(found.remarks("GNSS time"))
        assert remarks and all(remark.code == "week_number" for remark in remarks)
        assert all(f"told a date {weeks} week" in remark.text and "before" in remark.text for remark in remarks)


@pytest.mark.parametrize("at", [0, 7, 30, 58])
@pytest.mark.parametrize("off_s", [2.0, -3.0, 3_600.0, 7.0 * DAY_S, -1024 * 7.0 * DAY_S])
def test_two_outliers_do_not_flip_a_log(at: int, off_s: float) -> None:
    zeros = readings([(60, 0.0)])
    zeros[at : at + 2] += round(off_s * 1e9)
    found = zero_of_readings(zeros)
    assert abs(found.ns - ZERO_NS) <= TOLERANCE_NS and not found.passed_over


def test_one_level_is_the_median_of_all_readings() -> None:
    """Messages that come late, up to seconds, are no levels."""
    zeros = ZERO_NS - np.random.default_rng(3).exponential(0.4e9, 501).astype(np.int64)
    found = zero_of_readings(zeros)
    assert found.ns == int(np.sort(zeros)[250]) and len(found.zeros_ns) == 501 and not found.passed_over


def test_a_receiver_that_starts_again_falls_back_to_its_default() -> None:
    found = zero_of_readings(readings([(50, 2.0), (40, 0.0), (90, 2.0)]))
    assert abs(found.ns - ZERO_NS) <= TOLERANCE_NS
    assert sum(count for count, _away in found.passed_over) == 140


def test_a_clock_set_by_another_amount_is_told_with_its_size() -> None:
    found = zero_of_readings(readings([(50, -37.3), (40, 0.0)]))
    assert abs(found.ns - ZERO_NS) <= TOLERANCE_NS
    (remark,) = found.remarks("time_utc")
    assert remark.code == "clock_disagrees" and "50 readings told a time -37." in remark.text


def test_messages_that_come_late_together_are_no_level() -> None:
    for away_s in (-2.16, -2.0, 2.0):
        found = zero_of_readings(readings([(200, 0.0), (4, away_s), (200, 0.0)]))
        assert len(found.zeros_ns) == 404 and not found.passed_over


def test_whole_seconds_that_beat_with_the_readings_are_one_level() -> None:
    """A clock of whole seconds read every 1.03 s: what it tells falls behind, and catches up by a second."""
    device = np.rint(np.arange(300) * 1.03e9).astype(np.int64)
    found = told_at_zero((ZERO_NS + device) // NS_PER_S * NS_PER_S, device)
    assert not found.passed_over and abs(found.ns - ZERO_NS) < 0.6e9


# --- rollovers


LAST_LEAP_NS = iso_to_utc_ns("2017-01-01T00:00:00Z")[0]


@given(days=st.integers(0, 6_900))
def test_eighteen_leap_seconds_show_the_epoch(days: int) -> None:
    true_ns = LAST_LEAP_NS + days * DAY_S * NS_PER_S
    found = rollovers(true_ns - ROLLOVER_NS, leap_s=18)
    assert found.count == 1 and [remark.code for remark in found.remarks] == [CODE]
    assert utc_ns_to_iso(true_ns)[:10] in found.remarks[0].text
    assert rollovers(true_ns, leap_s=18).count == 0, "leap seconds that agree show nothing"
    assert rollovers(true_ns, leap_s=16).count == 0, "a receiver's default lags behind: it shows nothing"


@pytest.mark.parametrize(
    ("told", "true"),
    [("2004-09-20T10:00:05Z", "2024-05-06T10:00:00Z"), ("1999-09-13T10:00:05Z", "2019-04-29T10:00:00Z")],
)
def test_gps_time_has_the_leap_seconds_of_the_true_day(told: str, true: str) -> None:
    told_ns, true_ns = iso_to_utc_ns(told)[0], iso_to_utc_ns(true)[0]
    found = rollovers(told_ns, leap_s=18)
    assert told_ns + found.shift_ns(told_ns, is_gps_time=True) == true_ns
    assert found.shift_ns(told_ns, is_gps_time=False) == ROLLOVER_NS


def test_other_clocks_and_firmware_show_the_epoch() -> None:
    true_ns = ZERO_NS
    for count in (1, 2):
        told_ns = true_ns - count * ROLLOVER_NS
        other = OtherDate("the log's name", true_ns + 3_600 * NS_PER_S)
        assert rollovers(told_ns, others=(other,)).count == count
        assert rollovers(told_ns, earliest=Earliest(2019, "PX4 v1.11")).count == count
    week_off = OtherDate("the log's name", true_ns + WEEK_NS)
    assert rollovers(true_ns - ROLLOVER_NS, others=(week_off,)).count == 0


def test_what_is_old_itself_shows_a_wrong_date_and_moves_nothing() -> None:
    told_ns = ZERO_NS - ROLLOVER_NS
    for earliest in (Earliest(2016, "the ULog format", moves=False), Earliest(2008, "a firmware")):
        found = rollovers(told_ns, earliest=earliest)
        assert found.count == 0 and "cannot be true" in found.remarks[0].text and "2024-05-06" in found.remarks[0].text
    assert rollovers(told_ns, earliest=Earliest(2004, "a firmware")).remarks == ()
