"""Quantiles against scipy.stats and scipy.special; the package never imports the first."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import special, stats

import groundstation
from groundstation.base.quantiles import (
    chi_square_quantile,
    length_quantile,
    normal_above,
    normal_below,
    share_quantile,
    student_quantile,
)

PACKAGE = Path(groundstation.__file__).parent


@pytest.mark.parametrize("probability", [0.005, 0.3, 0.975, 0.99865])
@pytest.mark.parametrize("freedom", [1, 7, 300])
def test_quantiles_are_those_of_scipy(probability: float, freedom: int) -> None:
    assert float(chi_square_quantile(probability, freedom)) == pytest.approx(stats.chi2.ppf(probability, freedom))
    assert student_quantile(probability, freedom) == pytest.approx(stats.t.ppf(probability, freedom))
    assert share_quantile(probability, freedom, 3) == pytest.approx(stats.beta.ppf(probability, freedom, 3))


FREEDOMS = (*(0.3, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 7.5, 20.0, 99.0, 199.5, 201.0), *(1e3, 3.9e3, 4.1e3, 1e6, 1e12))
CHANCES = (1e-9, 1e-6, 0.001, 0.025, 0.05, 0.2, 0.4, 0.45)


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_students_quantile_is_that_of_scipy_from_a_third_to_any_degrees_of_freedom(freedom: float) -> None:
    for chance in CHANCES:
        low, high = student_quantile(chance, freedom), student_quantile(1.0 - chance, freedom)
        assert low == pytest.approx(float(special.stdtrit(freedom, chance)), rel=1e-10)
        assert high == pytest.approx(-low, rel=1e-16 / chance * max(10.0, 10.0 / freedom))  # 1 - chance is rounded


@pytest.mark.parametrize("freedom", FREEDOMS[:-1])
@pytest.mark.parametrize("chance", [1e-80, 1e-12, 0.3, 0.499])
def test_students_quantile_leaves_the_chance_that_was_asked_for(chance: float, freedom: float) -> None:
    value = student_quantile(chance, freedom)
    if math.isfinite(value * value):
        found = 0.5 * special.betainc(0.5 * freedom, 0.5, 1.0 / (1.0 + value * value / freedom))
        assert float(found) == pytest.approx(chance, rel=1e-9)


@pytest.mark.parametrize(("probability", "freedom", "expected"), [(0.5, 3.0, 0.0), (1.0, 3.0, math.inf)])
def test_students_quantile_at_its_ends(probability: float, freedom: float, expected: float) -> None:
    assert student_quantile(probability, freedom) == expected
    assert student_quantile(1.0 - probability, freedom) == -expected


@pytest.mark.parametrize(("probability", "freedom"), [(0.9, 0.0), (0.9, -1.0), (0.9, math.nan), (math.nan, 3.0)])
def test_students_quantile_of_no_number_is_none(probability: float, freedom: float) -> None:
    assert math.isnan(student_quantile(probability, freedom))


def test_students_quantile_of_endless_freedom_is_the_normal_one() -> None:
    assert student_quantile(0.975, math.inf) == pytest.approx(float(special.ndtri(0.975)), rel=1e-14)


@pytest.mark.parametrize("chance", [1e-300, 1e-30, 1e-9, *CHANCES, 0.499])
def test_normal_quantile_is_that_of_scipy(chance: float) -> None:
    assert normal_above(chance) == pytest.approx(-float(special.ndtri(chance)), rel=1e-12)


@pytest.mark.parametrize("failures", [0.5, 1.0, 1.5, 3.0, 14.0, 99.5, 5e3, 1e6])
@pytest.mark.parametrize("successes", [0.5, 1.0, 2.0, 16.0, 300.0, 1e5])
def test_share_quantile_is_that_of_scipy(successes: float, failures: float) -> None:
    for probability in (1e-6, 0.001, 0.025, 0.3, 0.5, 0.9, 0.975, 0.999):
        expected = float(special.betaincinv(successes, failures, probability))
        assert share_quantile(probability, successes, failures) == pytest.approx(expected, rel=1e-9)


def test_share_quantile_at_its_ends() -> None:
    assert [share_quantile(one, 3.0, 2.0) for one in (0.0, 1.0)] == [0.0, 1.0]
    assert all(math.isnan(share_quantile(0.5, *one)) for one in ((0.0, 1.0), (1.0, math.nan), (1.0, math.inf)))


def test_chances_below_normal_values_are_those_of_scipy() -> None:
    z = np.array([-30.0, -8.0, -1.0, 0.0, 1e-9, 2.5, 9.0, math.inf, -math.inf])
    assert normal_below(z) == pytest.approx(special.ndtr(z), rel=1e-13)
    assert normal_below(z[:0]).tolist() == []


@pytest.mark.parametrize("length", [0.0, 1e-6, 0.02, 0.1, 0.5, 1.6, 2.0, 6.0, 30.0, 200.0, 2e4])
@pytest.mark.parametrize("probability", [1e-6, 0.01, 0.5, 0.6, 0.97, 0.999])
def test_length_quantile_is_that_of_rice(probability: float, length: float) -> None:
    of_scipy = 0.2 * math.sqrt(special.chndtrix(probability, 2.0, (length / 0.2) ** 2))
    assert length_quantile(probability, length, 0.2) == pytest.approx(of_scipy, rel=1e-11)


@pytest.mark.parametrize("length", [0.0, 0.5, 30.0])
def test_length_quantile_is_that_of_scipy_stats(length: float) -> None:
    assert length_quantile(0.97, length, 0.2) == pytest.approx(stats.rice.ppf(0.97, length / 0.2, scale=0.2))


def test_no_module_imports_scipy_stats() -> None:
    """It takes 0.6 s, more than all the quantiles of a run together."""
    wrong = ("from scipy.stats", "from scipy import stats", "import scipy.stats")
    sources = {path.name: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    assert not [name for name, text in sources.items() if any(line in text for line in wrong)]
