"""The table of categories and its 95 % figures against their definitions."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2, norm

from groundstation.results.landing_categories import (
    CATEGORIES,
    LINEAR_95,
    RADIAL_95,
    axis_95_m,
    axis_category_met,
    category_met,
    radius_95_m,
)

SHARE = 0.95
COUNTING = 3.5 * np.sqrt(0.05 * 0.95 / 200_000)  # of a share over so many draws


def test_factors_are_those_of_one_and_two_dimensions() -> None:
    assert pytest.approx(norm.ppf(0.975), abs=1e-4) == LINEAR_95
    assert pytest.approx(np.sqrt(chi2.ppf(SHARE, 2)), abs=1e-6) == RADIAL_95


@pytest.mark.parametrize("sigmas", [(1.0, 1.0), (5.0, 2.0), (3.0, 0.1)])
def test_radius_holds_95_percent_of_drawn_errors(sigmas: tuple[float, float]) -> None:
    turn_rad = np.deg2rad(137.0)
    axes = np.array([[np.cos(turn_rad), -np.sin(turn_rad)], [np.sin(turn_rad), np.cos(turn_rad)]])
    covariance = axes @ np.diag(np.square(sigmas)) @ axes.T
    drawn = np.random.default_rng(4).multivariate_normal(np.zeros(2), covariance, 200_000)
    share = np.mean(np.hypot(*drawn.T) <= radius_95_m(covariance))
    assert abs(share - SHARE) < COUNTING


def test_radius_is_never_mixed_with_an_axis() -> None:
    covariance = np.diag([9.0, 9.0])
    assert radius_95_m(covariance) > 1.2 * axis_95_m(3.0)
    assert radius_95_m(np.zeros((4, 2, 2))).tolist() == [0.0] * 4


def test_categories_grow_stricter() -> None:
    for loose, strict in pairwise(CATEGORIES):
        assert strict.horizontal_m < loose.horizontal_m
        assert strict.vertical_m <= loose.vertical_m
        assert strict.course_line_m < loose.course_line_m
    assert [one.is_ils_look_alike for one in CATEGORIES] == [False, True, True]
    assert "ILS look-alike" in CATEGORIES[1].label


def test_no_number_meets_no_category() -> None:
    assert category_met(np.nan, 1.0) is None
    assert axis_category_met(np.nan, "vertical") is None
    found = category_met(6.0, 2.0)
    assert found is not None
    assert found.name == "CAT IIIB"
