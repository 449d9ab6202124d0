"""Scales and ticks of pictures, by value."""

import math

import numpy as np
import pytest

from groundstation.plots.scales import ScaleSpan, span_of
from groundstation.reports.svg.ticks import of_decade, own_ticks, ticks_of


def told(span: ScaleSpan, length_pt: float = 300.0, *, is_upright: bool = True) -> list[str]:
    return [text for _, text in ticks_of(span, length_pt, is_upright=is_upright)]


@pytest.mark.parametrize(
    ("span", "values", "shares"),
    [
        (ScaleSpan("linear", 0.0, 10.0), [0.0, 2.5, 10.0, 20.0], [0.0, 0.25, 1.0, 2.0]),
        (ScaleSpan("linear", 10.0, 0.0), [0.0, 2.5, 10.0], [1.0, 0.75, 0.0]),
        (ScaleSpan("log", 1.0, 100.0), [1.0, 10.0, 100.0, 0.0, -1.0], [0.0, 0.5, 1.0, math.nan, math.nan]),
        (ScaleSpan("symlog", -100.0, 100.0, 1.0), [-100.0, 0.0, 100.0], [0.0, 0.5, 1.0]),
        (ScaleSpan("time", 0.0, 60.0), [30.0, math.inf, math.nan], [0.5, math.nan, math.nan]),
    ],
)
def test_share_of_a_value(span: ScaleSpan, values: list[float], shares: list[float]) -> None:
    np.testing.assert_allclose(span.shares(np.array(values)), shares)


def test_symlog_is_linear_up_to_its_bound_and_goes_on_without_a_leap() -> None:
    span = ScaleSpan("symlog", -1000.0, 1000.0, 20.0)
    steps = np.diff(span.shares(np.linspace(-20.0, 20.0, 41)))
    np.testing.assert_allclose(steps, steps[0])
    below, above = span.shares(np.array([20.0 - 1e-9, 20.0 + 1e-9]))
    assert above - below == pytest.approx(0.0, abs=1e-9)
    assert span.share(200.0) - span.share(20.0) == pytest.approx(span.share(2000.0) - span.share(200.0))


def test_ends_of_what_is_drawn() -> None:
    assert span_of("linear", None, None, np.array([0.0, 10.0])) == ScaleSpan("linear", -0.5, 10.5)
    assert span_of("linear", 0.0, None, np.array([2.0, 10.0])) == ScaleSpan("linear", 0.0, 10.5)
    assert span_of("time", None, None, np.array([0.0, 10.0]), is_tight=True) == ScaleSpan("time", 0.0, 10.0)
    assert span_of("linear", 10.0, 0.0, np.zeros(0)) == ScaleSpan("linear", 10.0, 0.0)
    low, high = (
        end
        for end in vars(span_of("log", None, None, np.array([-1.0, 0.0, 1.0, 100.0]))).values()
        if end != "log" and end != 1.0
    )
    assert (low, high) == pytest.approx((10.0**-0.1, 10.0**2.1))


def test_ticks_of_numbers_are_round_and_of_equal_decimals() -> None:
    assert told(ScaleSpan("linear", -1.0, 1.0), 100.0) == ["−1.0", "−0.5", "0.0", "0.5", "1.0"]
    assert told(ScaleSpan("linear", 0.0, 30_000.0), 80.0) == ["0", "10\u202f000", "20\u202f000", "30\u202f000"]
    assert told(ScaleSpan("linear", 0.0, 4e-7), 60.0) == ["0", "2·10⁻⁷", "4·10⁻⁷"]
    assert told(ScaleSpan("linear", 10.0, 0.0), 60.0) == ["0", "5", "10"]


def test_ticks_never_stand_closer_than_their_text() -> None:
    for low, high in ((0.0, 1.0), (123_456.0, 123_456.5), (-2e6, 5e6), (0.001, 0.0012)):
        ticks = ticks_of(ScaleSpan("linear", low, high), 120.0, is_upright=False)
        room = 120.0 * np.diff([place for place, _ in ticks]) / (high - low)
        assert len(ticks) >= 1
        assert np.all(room > max(5.0 * len(text) for _, text in ticks)) or len(ticks) <= 2


@pytest.mark.parametrize(
    ("end", "texts"),
    [
        (2.0, ["0:00.0", "0:00.5", "0:01.0", "0:01.5", "0:02.0"]),
        (10.0, ["0:00", "0:02", "0:04", "0:06", "0:08", "0:10"]),
        (90.0, ["0:00", "0:15", "0:30", "0:45", "1:00", "1:15", "1:30"]),
        (7200.0, ["0:00", "30:00", "1:00:00", "1:30:00", "2:00:00"]),
        (30 * 86_400.0, ["0:00", "168:00:00", "336:00:00", "504:00:00", "672:00:00"]),
    ],
)
def test_ticks_of_time_are_round(end: float, texts: list[str]) -> None:
    assert told(ScaleSpan("time", 0.0, end), 300.0, is_upright=False) == texts


@pytest.mark.parametrize(
    ("days", "texts"),
    [
        (3.0, ["1970-01-01", "1970-01-02", "1970-01-03", "1970-01-04"]),
        (200.0, ["1970-01", "1970-03", "1970-05", "1970-07"]),
        (1500.0, ["1970", "1971", "1972", "1973", "1974"]),
    ],
)
def test_ticks_of_dates_are_round(days: float, texts: list[str]) -> None:
    assert told(ScaleSpan("date", 0.0, 86_400.0 * days), 320.0, is_upright=False) == texts


def test_ticks_of_angles_are_in_thirties() -> None:
    assert told(ScaleSpan("angle", 0.0, 360.0), 440.0, is_upright=False) == [str(30 * step) for step in range(13)]
    assert told(ScaleSpan("angle", 0.0, 360.0), 190.0, is_upright=False) == [str(60 * step) for step in range(7)]
    assert told(ScaleSpan("angle", -2.0, 2.0), 100.0) == ["−2", "−1", "0", "1", "2"]


def test_ticks_of_a_log_axis() -> None:
    assert told(ScaleSpan("log", 0.1, 10.0), 120.0) == ["0.1", "0.2", "0.5", "1", "2", "5", "10"]
    assert told(ScaleSpan("log", 1e-8, 1e4), 100.0) == ["10⁻⁸", "10⁻⁶", "10⁻⁴", "10⁻²", "1", "10²", "10⁴"]
    assert told(ScaleSpan("log", 12.0, 18.0), 100.0) == ["12", "14", "16", "18"]  # no two of 1, 2, 5 lie within


def test_ticks_of_a_symlog_axis() -> None:
    assert told(ScaleSpan("symlog", -1000.0, 1000.0, 10.0), 120.0) == ["−1000", "−100", "−10", "0", "10", "100", "1000"]


def test_own_ticks_and_round_numbers() -> None:
    assert own_ticks((0.0, 68.27, math.nan, 100.0)) == ((0.0, "0"), (68.27, "68.27"), (100.0, "100"))
    assert [of_decade(value, as_power=True) for value in (0.1, 1.0, 10.0, 100.0)] == ["10⁻¹", "1", "10", "10²"]
