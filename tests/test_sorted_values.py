"""Quantiles by sorting are those of numpy, to the bit; so are medians and distinct values."""

import numpy as np
import pytest

from groundstation.base.sorted_values import distinct, median, quantile


@pytest.mark.parametrize("count", [1, 2, 3, 10, 11, 1000])
def test_values_are_those_of_numpy(count: int) -> None:
    rng = np.random.default_rng(count)
    for values in (rng.normal(0.0, 1e3, count), rng.integers(-(10**15), 10**15, count)):
        for share in (0.0, 0.05, 0.25, 0.5, 0.7, 0.9, 0.99, 1.0):
            assert quantile(values, share) == float(np.quantile(values, share))
        assert median(values.astype(np.float64)) == float(np.median(values.astype(np.float64)))
        drawn = values[rng.integers(0, count, 50)]
        assert distinct(drawn).tolist() == np.unique(drawn).tolist()


def test_nothing_and_nan_have_no_quantile() -> None:
    assert np.isnan(quantile(np.zeros(0), 0.5))
    assert np.isnan(quantile(np.array([1.0, np.nan]), 0.0))
