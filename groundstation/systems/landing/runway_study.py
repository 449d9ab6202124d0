"""Monte Carlo study of the choice of the runway from the table.

Is the runway that is named the right one, and how often is one named? The family was written down before it was run: a
runway of the shipped table, each as likely, landed on in one direction; touchdown 150 to 800 m behind the threshold, no
farther than a third of the way; centre line held to 5 m, course known to 1 deg; the runway of the table lies as far off
as its sigmas say; positions of a receiver (15 m) or of an INS whose errors have a long tail (Cauchy, 300 m). The other
families each break one assumption.
"""

import math
from collections.abc import Callable

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.runways.kept import shipped_runways
from groundstation.base.runways.table import RunwayDirection, RunwayTable
from groundstation.systems.landing.runway_choice import EndOfApproach, choose_runway
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.study import StudyResult, judged_families, section, table, table_of

Progress = Callable[[str], None]
ASSUMED = LandingSettings()
FIRST_M, LAST_M, LAST_SHARE = 150.0, 800.0, 1.0 / 3.0
ASIDE_SIGMA_M, COURSE_SIGMA_DEG = 5.0, 1.0


@dataclass(frozen=True, kw_only=True)
class ChoiceFamily:
    """Family of ends of approaches, and its change to those of the plain family.

    Parameters
    ----------
    scale_m : float
        Scale of the position error that the search takes; it is drawn from a Cauchy law of that scale in the plane, or
        from a normal law of ``normal_m`` on each axis.
    table_m, along_m : float
        Shift of the runway in the table beside that of its sigmas; of the touchdown along the runway.
    is_listed : bool
        False: the runway is not in the table.
    is_guided : bool
        An approach aid was followed.
    height_m : float or None
        Height at which the approach ended; None: a touchdown.
    """

    name: str
    what: str
    scale_m: float = ASSUMED.gnss_position_scale_m
    normal_m: float | None = 5.0
    table_m: float = 0.0
    along_m: float = 0.0
    is_listed: bool = True
    is_guided: bool = False
    height_m: float | None = None


INS_M = ASSUMED.ins_position_scale_m
FAMILIES: tuple[ChoiceFamily, ...] = (
    ChoiceFamily(name="receiver", what="as assumed, positions of a receiver"),
    ChoiceFamily(name="ins", what="as assumed, positions of an INS", scale_m=INS_M, normal_m=None),
    ChoiceFamily(name="guided ins", what="the same on an ILS", scale_m=INS_M, normal_m=None, is_guided=True),
    ChoiceFamily(
        name="go-around",
        what="the same, broken off at 150 m",
        scale_m=INS_M,
        normal_m=None,
        is_guided=True,
        height_m=150.0,
    ),
    ChoiceFamily(
        name="drifted", what="INS off by 1.5 km on each axis", scale_m=INS_M, normal_m=1_500.0, is_guided=True
    ),
    ChoiceFamily(name="early", what="receiver; touchdown told 6 s, 400 m, early", along_m=-400.0),
    ChoiceFamily(name="shifted", what="receiver; runway of the table 150 m off", table_m=150.0),
    ChoiceFamily(name="unlisted", what="receiver; the runway is not in the table", is_listed=False),
    ChoiceFamily(
        name="unlisted ins",
        what="INS without an aid; the runway is not in the table",
        scale_m=INS_M,
        normal_m=None,
        is_listed=False,
    ),
)


def study_runways(
    runs: int = 1000, seed: int = 0, progress: Progress | None = None, *, families: tuple[ChoiceFamily, ...] = FAMILIES
) -> StudyResult:
    """Search the table for the ends of every family, and judge the runways named.

    Parameters
    ----------
    runs : int
        Ends of each family.
    seed : int
        Run k of every family has the seed (seed, k).
    progress : callable, optional
        Called with one line for each family.
    families : tuple of ChoiceFamily
    """
    shipped = shipped_runways()
    rows = judged_families(
        families,
        lambda one: _judged(one, shipped, runs, seed),
        progress,
        lambda row: f"{row['decided']:.2f} decided",
    )
    data = table_of("runway_choice", rows, DIGITS)
    head = section(
        "Study: the choice of the runway from the table",
        f"{runs} ends of approaches of each family (seed {seed}), {shipped.version}. Right: of the decided ones, the "
        "runway landed on was named. Held: of those with a runway in the table, it is among the candidates.",
        table(data),
        *(f"{family.name}: {family.what}" for family in families),
    )
    return StudyResult("runways", (data,), (head,))


DIGITS = dict.fromkeys(("decided", "right", "right_sigma", "not_decided", "held", "none"), 3)


def drawn_end(
    family: ChoiceFamily, shipped: RunwayTable, rng: np.random.Generator
) -> tuple[EndOfApproach, RunwayDirection, int]:
    """Return the end of an approach, the runway it led to, and its row of the table."""
    row = int(rng.integers(len(shipped)))
    runway = list(shipped.directions(row))[int(rng.integers(2))]
    last_m = max(min(LAST_M, LAST_SHARE * runway.landing_length_m), FIRST_M + 1.0)
    along_m = float(rng.uniform(FIRST_M, last_m)) + family.along_m
    if family.height_m is not None:
        slope = math.tan(math.radians(ASSUMED.glide_angle_deg))
        along_m = -(family.height_m - ASSUMED.threshold_crossing_height_m) / slope * float(rng.normal(1.0, 0.1))
    across_m = float(rng.normal(0.0, ASIDE_SIGMA_M))
    turned_deg = float(rng.normal(0.0, runway.course_sigma_deg))
    along_m += float(rng.normal(0.0, runway.along_sigma_m))
    across_m += float(rng.normal(0.0, runway.across_sigma_m))
    course_rad = math.radians(runway.true_course_deg)
    off = _position_error(family, rng) + family.table_m * _direction(rng)
    north_m = along_m * math.cos(course_rad) - across_m * math.sin(course_rad) + off[0]
    east_m = along_m * math.sin(course_rad) + across_m * math.cos(course_rad) + off[1]
    latitude, longitude = latitude_longitude_deg(north_m, east_m, runway.latitude_deg, runway.longitude_deg)
    course_deg = (runway.true_course_deg + turned_deg + float(rng.normal(0.0, COURSE_SIGMA_DEG))) % 360.0
    end = EndOfApproach(
        float(latitude), float(longitude), course_deg, family.height_m, family.scale_m, family.is_guided
    )
    return end, runway, row


def _position_error(family: ChoiceFamily, rng: np.random.Generator) -> np.ndarray:
    """Return an error north and east: normal, or of the long-tailed law that the search takes."""
    if family.normal_m is not None:
        return np.asarray(rng.normal(0.0, family.normal_m, 2))
    share = float(rng.uniform())
    return family.scale_m * math.sqrt(1.0 / (1.0 - share) ** 2 - 1.0) * _direction(rng)


def _direction(rng: np.random.Generator) -> np.ndarray:
    angle = float(rng.uniform(0.0, 2.0 * math.pi))
    return np.array([math.cos(angle), math.sin(angle)])


def _judged(family: ChoiceFamily, shipped: RunwayTable, runs: int, seed: int) -> dict[str, object]:
    decided = right = open_ = held = none = 0
    for run in range(runs):
        end, runway, row = drawn_end(family, shipped, np.random.default_rng((seed, run)))
        asked = shipped if family.is_listed else shipped.without(row)
        chosen = choose_runway(end, asked, ASSUMED)
        names = [one.name for one in chosen.choice.candidates]
        decided += chosen.choice.state == "decided"
        right += chosen.choice.state == "decided" and names[0] == runway.full_name and family.is_listed
        open_ += chosen.choice.state == "not decided"
        none += chosen.choice.state == "none"
        held += family.is_listed and runway.full_name in names
    share = right / decided if decided else np.nan
    return {
        "family": family.name,
        "decided": decided / runs,
        "right": share,
        "right_sigma": math.sqrt(share * (1.0 - share) / decided) if decided else np.nan,
        "not_decided": open_ / runs,
        "none": none / runs,
        "held": held / runs if family.is_listed else np.nan,
    }
