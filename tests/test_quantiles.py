"""Quantiles from scipy.special against scipy.stats, which the package never imports."""

from pathlib import Path

import pytest
from scipy import stats

import groundstation
from groundstation.base.quantiles import chi_square_quantile, length_quantile, share_quantile, student_quantile

PACKAGE = Path(groundstation.__file__).parent


@pytest.mark.parametrize("probability", [0.005, 0.3, 0.975, 0.99865])
@pytest.mark.parametrize("freedom", [1, 7, 300])
def test_quantiles_are_those_of_scipy(probability: float, freedom: int) -> None:
    assert float(chi_square_quantile(probability, freedom)) == pytest.approx(stats.chi2.ppf(probability, freedom))
    assert student_quantile(probability, freedom) == pytest.approx(stats.t.ppf(probability, freedom))
    assert share_quantile(probability, freedom, 3) == pytest.approx(stats.beta.ppf(probability, freedom, 3))


@pytest.mark.parametrize("length", [0.0, 0.5, 30.0])
def test_length_quantile_is_that_of_rice(length: float) -> None:
    assert length_quantile(0.97, length, 0.2) == pytest.approx(stats.rice.ppf(0.97, length / 0.2, scale=0.2))


def test_no_module_imports_scipy_stats() -> None:
    """It takes 0.6 s, more than all the quantiles of a run together."""
    wrong = ("from scipy.stats", "from scipy import stats", "import scipy.stats")
    sources = {path.name: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    assert not [name for name, text in sources.items() if any(line in text for line in wrong)]
