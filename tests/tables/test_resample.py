"""Joins on time, and gaps: across north and the date line, with NaN, repeated times, one sample, none."""

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.tables.gaps import break_lines, find_gaps, largest_step_s, split_at_gaps, with_gap_breaks
from groundstation.tables.resample import join, values_at
from groundstation.tables.table import Table


def seconds(*times_s: float) -> NDArray[np.int64]:
    return np.round(np.array(times_s, dtype=np.float64) * NS_PER_S).astype(np.int64)


def table(times_s: list[float], topic: str = "ins", **columns: object) -> Table:
    index = np.arange(len(times_s))
    arrays = {
        name: values if isinstance(values, Column) else Column(np.array(values)) for name, values in columns.items()
    }
    return Table(topic, seconds(*times_s), arrays, index, Column(index))


def test_numbers_are_interpolated_and_never_extrapolated() -> None:
    source = table([0.0, 1.0, 5.0], pitch_deg=[0.0, 2.0, 6.0])
    at = seconds(-0.1, 0.0, 0.25, 1.0, 3.0, 5.0, 5.1)
    expected = [np.nan, 0.0, 0.5, 2.0, np.nan, 6.0, np.nan]  # 1 to 5 s is longer than the largest gap
    np.testing.assert_array_equal(values_at(source, "pitch_deg", at, largest_gap_s=1.0), expected)
    assert values_at(source, "pitch_deg", at, largest_gap_s=np.inf)[4] == 4.0
    joined = join(source, at, largest_gap_s=1.0)
    assert joined.columns["pitch_deg"].mask.tolist() == [False, True, True, True, False, True, False]
    assert np.isnan(values_at(source, "no_such_field", at, largest_gap_s=1.0)).all()


@pytest.mark.parametrize(
    ("topic", "name", "first", "second", "middle"),
    [
        ("ins", "true_heading_deg", 350.0, 20.0, 5.0),
        ("ins", "true_heading_deg", 20.0, 350.0, 5.0),
        ("gnss", "track_deg", 359.0, 1.0, 0.0),
        ("gnss", "longitude_deg", 179.5, -179.5, -180.0),
        ("ins", "roll_deg", 170.0, -170.0, -180.0),
        ("ins", "pitch_deg", 10.0, 20.0, 15.0),
        ("raw.x", "heading_deg", 350.0, 20.0, 185.0),  # nobody says what a raw field is
    ],
)
def test_angles_take_the_shorter_arc(topic: str, name: str, first: float, second: float, middle: float) -> None:
    source = table([0.0, 1.0], topic, **{name: [first, second]})
    assert values_at(source, name, seconds(0.5), largest_gap_s=1.0)[0] == pytest.approx(middle, abs=1e-12)


def test_nan_and_absent_samples_are_passed_over() -> None:
    present = np.array([True, True, False, True])
    source = table([0.0, 1.0, 1.5, 2.0], pitch_deg=Column(np.array([0.0, np.nan, 77.0, 4.0]), present))
    assert values_at(source, "pitch_deg", seconds(1.0), largest_gap_s=2.0)[0] == 2.0
    assert np.isnan(values_at(source, "pitch_deg", seconds(1.0), largest_gap_s=1.9)[0])
    nothing = table([0.0, 1.0], pitch_deg=[np.nan, np.nan])
    assert np.isnan(values_at(nothing, "pitch_deg", seconds(0.0, 0.5), largest_gap_s=9.0)).all()


def test_states_are_held_or_taken_from_the_nearest_sample() -> None:
    source = table([0.0, 1.0, 1.0, 2.0], valid=[True, False, True, False], mode=["align", "x", "nav", "attitude"])
    at = seconds(-0.2, 0.4, 0.8, 1.0, 2.5, 4.0)
    previous = join(source, at, largest_gap_s=1.0)
    assert previous.text("mode").tolist() == ["", "align", "align", "nav", "attitude", ""]
    np.testing.assert_array_equal(previous.values("valid"), [np.nan, 1.0, 1.0, 1.0, 0.0, np.nan])
    nearest = join(source, at, ["mode"], largest_gap_s=1.0, choice="nearest")
    assert nearest.text("mode").tolist() == ["align", "align", "x", "nav", "attitude", ""]
    assert "valid" not in nearest


def test_repeated_times_give_numbers_of_the_first_sample() -> None:
    source = table([0.0, 1.0, 1.0, 2.0], pitch_deg=[0.0, 1.0, 50.0, 3.0])
    assert values_at(source, "pitch_deg", seconds(0.5, 1.0, 1.5), largest_gap_s=1.0).tolist() == [0.5, 1.0, 2.0]


@pytest.mark.parametrize("times", [[], [1.0]])
def test_one_sample_or_none(times: list[float]) -> None:
    source = table(times, pitch_deg=np.full(len(times), 2.0), mode=np.full(len(times), "nav"))
    joined = join(source, seconds(0.0, 1.0, 3.0), largest_gap_s=1.0)
    held = ["", "nav", ""] if times else ["", "", ""]
    np.testing.assert_array_equal(joined.values("pitch_deg"), [np.nan, 2.0 if times else np.nan, np.nan])
    assert joined.text("mode").tolist() == held
    assert len(join(source, seconds(), largest_gap_s=1.0)) == 0


def test_interpolation_keeps_nanoseconds_of_today() -> None:
    start = 1_777_874_400_000_000_000
    source = Table(
        "ins",
        np.array([start, start + 1000]),
        {"pitch_deg": Column(np.array([0.0, 1.0]))},
        np.arange(2),
        Column(np.arange(2)),
    )
    assert values_at(source, "pitch_deg", np.array([start + 7]), largest_gap_s=1.0)[0] == pytest.approx(0.007)


def test_gaps_follow_the_stated_rule() -> None:
    source = table([0.0, 1.0, 2.0, 3.0, 6.5, 7.5], pitch_deg=[1.0, np.nan, np.nan, np.nan, 2.0, 3.0])
    assert largest_step_s(source.time_ns) == 3.0
    assert [(gap.row, gap.start_ns, gap.length_s) for gap in find_gaps(source)] == [(3, 3 * NS_PER_S, 3.5)]
    assert find_gaps(source, largest_s=3.5) == ()
    (gap,) = find_gaps(source, "pitch_deg", largest_s=5.0)
    assert (gap.row, gap.length_s, gap.end_ns) == (0, 6.5, 6_500_000_000)
    assert [len(piece) for piece in split_at_gaps(source)] == [4, 2]
    assert split_at_gaps(table([])) == ()
    assert find_gaps(table([])) == find_gaps(table([1.0])) == find_gaps(table([1.0, 1.0])) == ()


def test_gap_breaks_are_rows_of_nan() -> None:
    source = table([0.0, 1.0, 9.0], a=[1.0, 2.0, 3.0], count=[1, 2, 3], flag=[True, True, True], mode=["x", "y", "z"])
    broken = with_gap_breaks(source, largest_s=2.0)
    assert broken.time_ns.tolist() == [0, NS_PER_S, NS_PER_S + 1, 9 * NS_PER_S]
    np.testing.assert_array_equal(broken.values("a"), [1.0, 2.0, np.nan, 3.0])
    np.testing.assert_array_equal(broken.values("count"), [1.0, 2.0, np.nan, 3.0])
    assert broken.columns["a"].mask.all()
    assert broken.columns["flag"].mask.tolist() == [True, True, False, True]
    assert broken.text("mode").tolist() == ["x", "y", "", "z"]
    assert broken.record_index.tolist() == [0, 1, -1, 2]
    assert with_gap_breaks(source, largest_s=8.0) is source
    time_ns, (a, pairs) = break_lines(source.time_ns, [source.values("a"), np.zeros((3, 2))], largest_s=2.0)
    assert np.isnan(a[2])
    assert np.isnan(pairs[2]).all()
    assert len(time_ns) == len(a) == len(pairs) == 4
