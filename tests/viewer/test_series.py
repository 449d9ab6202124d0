"""Rows of a line, found some at a time: the same as at once."""

import numpy as np
import pytest

from groundstation.viewer import series


@pytest.mark.parametrize("rows", [1, 12, 997, 1000])
def test_rows_at_once_change_nothing(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(rows)
    values = rng.normal(size=(rows, 3)).round(1)
    values[rng.random(values.shape) < 0.3] = np.nan
    time_ns = np.cumsum(rng.choice([10, 500], rows, p=[0.97, 0.03]))
    found = []
    for at_once in (1 << 18, 50, 1):
        monkeypatch.setattr(series, "ROWS_AT_ONCE", at_once)
        breaks = series.gap_after(time_ns)
        found.append((breaks.tolist(), series.thin(values, breaks, 60).tolist()))
    assert found[0] == found[1] == found[2]


def test_the_extremes_of_every_stretch_stay() -> None:
    values = np.sin(np.arange(1000.0))[:, None]
    kept = series.thin(values, np.zeros(999, dtype=bool), 40)
    for stretch in values.reshape(20, 50):
        assert {stretch.min(), stretch.max()} <= set(values[kept, 0])
