"""Published figures of landing by ranges, each with the approach for it.

Source: O. N. Skrypnik, thesis on navigation between aircraft, 2010, chapters 5 and 6.
"""

from dataclasses import replace
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.landing_categories import CATEGORIES
from groundstation.systems.planning.landing.plan import LANDING_PLAN
from groundstation.systems.planning.landing.scenario import OwnErrors, RangeApproach, RangeNoise
from groundstation.systems.shipped_plans import load_plan

FACTOR = 2.0  # a figure of ours within so many times of the published one counts as the same
FIRST_SEED = 90_000  # no smaller seed belongs to this study
Figure = Literal["touchdown_up", "least_along", "least_right", "least_up"]
Axis = Literal["lateral", "horizontal", "vertical"]
CAT_I, CAT_II, CAT_III = CATEGORIES


@dataclass(frozen=True)
class PublishedSigma:
    """One published sigma: its approach, its quantity, its value."""

    approach: str
    figure: Figure
    low: float
    high: float
    published: str


@dataclass(frozen=True)
class PublishedCategory:
    """One published claim of a category.

    Parameters
    ----------
    approach : str
    axis : str
        The error that is held against the category.
    category : str
        Claimed; empty: the claim is that none is met.
    published : str
    """

    approach: str
    axis: Axis
    category: str
    published: str


SIGMAS: tuple[PublishedSigma, ...] = (
    PublishedSigma("three-points-offset", "touchdown_up", 6.0, 7.0, "sigma_z 6-7 m at touchdown"),
    PublishedSigma("moving-fourth", "least_along", 0.29, 0.29, "sigma_x 0.29 m, least"),
    PublishedSigma("moving-fourth", "least_right", 0.23, 0.23, "sigma_y 0.23 m, least"),
    PublishedSigma("moving-fourth", "least_up", 0.6, 0.6, "sigma_z 0.6 m, least"),
    PublishedSigma("moving-fourth", "touchdown_up", 1.6, 1.8, "sigma_z 1.6-1.8 m at touchdown"),
)
CLAIMS: tuple[PublishedCategory, ...] = (
    PublishedCategory("one-point", "horizontal", "", "one point: no category"),
    PublishedCategory("one-point", "vertical", "", "one point: no category in height"),
    PublishedCategory("two-points", "lateral", CAT_I.name, "two points: category I laterally"),
    PublishedCategory("three-points-axis", "horizontal", CAT_I.name, "three points, text: category I horizontally"),
    PublishedCategory("three-points-axis", "horizontal", CAT_III.name, "three points, end: category III horizontally"),
    PublishedCategory("three-points-axis", "vertical", CAT_I.name, "third overflown, end: category I in height"),
    PublishedCategory("three-points-axis", "vertical", CAT_III.name, "third overflown, text: category III in height"),
    PublishedCategory("three-points-offset", "vertical", "", "third offset: no category in height"),
    PublishedCategory("moving-fourth", "lateral", CAT_III.name, "moving fourth: category III laterally"),
    PublishedCategory("moving-fourth", "vertical", CAT_I.name, "moving fourth: category I in height"),
    PublishedCategory("moving-fourth", "vertical", CAT_II.name, "moving fourth: category II in height"),
)
PUBLISHED = tuple(dict.fromkeys([one.approach for one in SIGMAS] + [one.approach for one in CLAIMS]))
FLOWN = ("three-points-axis", "three-points-offset", "three-points-near", "moving-fourth")  # with simulated approaches


def approach(name: str) -> RangeApproach:
    """Return a shipped approach."""
    return load_plan(LANDING_PLAN, name).scenario


def variations() -> dict[str, RangeApproach]:
    """Return the approach with the moving fourth point under changed conditions, by name.

    Other noise, baro and ranges.
    """
    base = approach("moving-fourth")
    noises = {
        "3 m each 0.01 s (the source)": RangeNoise(),
        "5 m each 0.01 s (the source's limit)": RangeNoise(white_m=5.0),
        "3 m each 0.1 s": RangeNoise(interval_s=0.1),
        "3 m each 0.5 s": RangeNoise(interval_s=0.5),
        **{
            f"3 m correlated over {seconds:g} s": RangeNoise(white_m=0.3, correlated_m=3.0, correlation_s=seconds)
            for seconds in (1.0, 2.0, 5.0, 10.0)
        },
    }
    changed = {name: replace(base, noise=noise) for name, noise in noises.items()}
    for baro_m in (10.0, 20.0, 100.0, 200.0):
        changed[f"baro {baro_m:g} m over 3600 s"] = replace(base, own=OwnErrors(baro_m=baro_m))
    assert base.moving is not None
    changed["speed of the aircraft not controlled"] = replace(base, moving=replace(base.moving, control="none"))
    return changed
