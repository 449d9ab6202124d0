"""Monte Carlo study of the criteria: does a verdict say what was flown?

The family is that of docs/evidence/approaches.md, written down before it was run. The other families each break one
assumption.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.methods.intervals import wilson_interval
from groundstation.simulation.approach import (
    ApproachScenario,
    FinalMotion,
    Recorded,
    TrueRunway,
    simulate_approach,
)
from groundstation.systems.known import Known, Runway, SiteData
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import Approach
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.study import StudyResult, section, table, table_of
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight, Table

Progress = Callable[[str], None]
ASSUMED = LandingSettings()
CHECK_M, FLOOR_M = ASSUMED.gate_low_m, ASSUMED.gate_floor_m
NAMES = ("flap", "gear", "speed", "tailwind")


@dataclass(frozen=True)
class CriteriaFamily:
    """Family of approaches: how channels are logged, and what is flown beside the plain ones."""

    name: str
    what: str
    switch_s: int = 4
    gust_s: float = 2.0
    wind_error_mps: float = 1.0
    is_reversed: bool = False
    is_rising: bool = False


FAMILIES = (
    CriteriaFamily("plain", "as assumed: switches each 4 s, gusts of 2 s, wind to 1 m/s"),
    CriteriaFamily("reversed", "the gear switch reads the other way round", is_reversed=True),
    CriteriaFamily("seldom", "switches each 8 s", switch_s=8),
    CriteriaFamily("gusts", "gusts of 5 s", gust_s=5.0),
    CriteriaFamily("wind", "wind to 5 m/s", wind_error_mps=5.0),
    CriteriaFamily("step", "flap set in two steps, 3 deg short of the last", is_rising=True),
)


class _Truth(NamedTuple):
    flap_m: float
    gear_m: float
    is_fast: bool
    tailwind_mps: float

    def is_met(self, name: str) -> bool:
        """Tell whether the criterion was truly kept from the lower check height down."""
        return {
            "flap": self.flap_m >= CHECK_M,
            "gear": self.gear_m >= CHECK_M,
            "speed": not self.is_fast,
            "tailwind": self.tailwind_mps <= (ASSUMED.criteria.tailwind.at_most or np.inf),
        }[name]


def study_criteria(
    runs: int = 100, seed: int = 0, progress: Progress | None = None, *, families: tuple[CriteriaFamily, ...] = FAMILIES
) -> StudyResult:
    """Fly every family and count verdicts that are right, wrong and undecided.

    Parameters
    ----------
    runs : int
        Approaches of each family.
    seed : int
        Run k of every family has the seed (seed, k).
    progress : callable, optional
        Called with one line for each family.
    families : tuple of CriteriaFamily
    """
    rows: list[dict[str, object]] = []
    for family in families:
        counts = _counted(family, runs, seed)
        rows += [_row(family.name, name, counts) for name in NAMES]
        if progress:
            progress(f"{family.name}: {sum(counts[name, 'wrong'] for name in NAMES)} wrong verdicts")
    data = table_of("landing_criteria", rows, DIGITS)
    page = section(
        "Study: the criteria of an approach",
        f"{runs} approaches of each family of docs/evidence/approaches.md (seed {seed}), through phases and analysis. "
        "Share of the decided verdicts that are wrong, with Wilson's 95 % interval; an undecided one is not wrong.",
        table(data),
        *(f"{family.name}: {family.what}" for family in families),
    )
    return StudyResult("criteria", (data,), (page,))


DIGITS = {
    **dict.fromkeys(("right", "wrong", "missed", "undecided", "not_judged"), 0),
    **dict.fromkeys(("wrong_share", "wrong_low", "wrong_high"), 3),
}


def _row(family: str, name: str, counts: Counter[tuple[str, str]]) -> dict[str, object]:
    right, wrong = counts[name, "right"], counts[name, "wrong"]
    low, high = wilson_interval(wrong, right + wrong)
    return {
        "family": family,
        "criterion": name,
        "right": float(right),
        "wrong": float(wrong),
        "missed": float(counts[name, "missed"]),  # of the wrong: met was said of what was not
        "undecided": float(counts[name, "undecided"]),
        "not_judged": float(counts[name, "none"]),
        "wrong_share": wrong / (right + wrong) if right + wrong else float("nan"),
        "wrong_low": low,
        "wrong_high": high,
    }


def _counted(family: CriteriaFamily, runs: int, seed: int) -> Counter[tuple[str, str]]:
    counts: Counter[tuple[str, str]] = Counter()
    for run in range(runs):
        flight, truth, site = flown(family, np.random.default_rng((seed, run)))
        one = _approach(flight, site)
        for name in NAMES:
            said = None if one is None else _said(one, name)
            if said in (None, "undecided"):
                counts[name, said or "none"] += 1
                continue
            is_right = (said == "met") == truth.is_met(name)
            counts[name, "right" if is_right else "wrong"] += 1
            counts[name, "missed"] += not is_right and said == "met"
    return counts


def _approach(flight: Flight, site: SiteData) -> Approach | None:
    try:
        found = LANDING.run(flight, Known(flight_phases(flight), site=site), ASSUMED).answer.approaches
    except NotAssessableError:
        return None
    return found[-1] if found else None


def _said(one: Approach, name: str) -> str | None:
    """Return met, not met or undecided; None where it was not judged."""
    if name == "tailwind":
        state = next(row.state for row in one.criteria if row.name == name)
        return state if state in ("met", "not met", "undecided") else None
    gate = next((gate for gate in one.stabilised[1].gates if gate.name == name), None)
    return {"passed": "met", "failed": "not met"}.get(gate.state) if gate else None


def flown(family: CriteriaFamily, rng: np.random.Generator) -> tuple[Flight, _Truth, SiteData]:
    """Return one approach of a family, the truth, and the site."""
    runway = TrueRunway(56.0, 38.0, float(rng.uniform(0, 360)))
    motion = FinalMotion(start_distance_m=float(rng.uniform(10_000, 16_000)), speed_mps=float(rng.uniform(60, 75)))
    scenario = ApproachScenario(runway, seed=int(rng.integers(1 << 30)), flown=motion, recorded=Recorded(step_deg=0.0))
    flight = simulate_approach(scenario).flight
    height = flight["baro"].values("height_above_airfield_m")
    truth = _Truth(
        float(rng.uniform(60, 400)),
        float(rng.uniform(60, 400)),
        bool(rng.random() < 0.5),
        float(rng.normal(0.0, 5.0)),
    )
    flight = _with(flight, "configuration", family.switch_s, **_switches(family, truth, height))
    flight = _with(flight, "air", 1, **_air(family, truth, height, runway, rng))
    site = SiteData(
        runways=(Runway("X", runway.true_course_deg, 0.05, latitude_deg=56.0, longitude_deg=38.0, length_m=3_000.0),)
    )
    return flight, truth, site


def _switches(family: CriteriaFamily, truth: _Truth, height_m: FloatArray) -> dict[str, FloatArray]:
    flap = np.where(height_m < truth.flap_m, 30.0, 5.0)
    if family.is_rising:  # the last 3 deg come late, at 100 m at most
        flap = np.where((height_m < truth.flap_m) & (height_m > min(100.0, truth.flap_m)), 27.0, flap)
    gear = (height_m < truth.gear_m) ^ family.is_reversed
    if family.is_reversed:
        gear &= height_m > 0.0
    return {"flap_deg": flap, "gear_down": gear.astype(float)}


def _air(
    family: CriteriaFamily, truth: _Truth, height_m: FloatArray, runway: TrueRunway, rng: np.random.Generator
) -> dict[str, FloatArray]:
    """Return the airspeed with gusts and, where flown so, an excess that lasts; and the wind."""
    speed = 70.0 + rng.normal(0.0, 1.0, len(height_m))
    below = np.flatnonzero((height_m < CHECK_M - 10.0) & (height_m > FLOOR_M + 40.0))
    for _ in range(2):
        at = int(rng.choice(below))
        speed[at : at + round(family.gust_s)] += rng.uniform(12.0, 18.0)
    if truth.is_fast:
        at = int(rng.choice(below))
        speed[at : at + int(rng.integers(6, 12))] += rng.uniform(14.0, 20.0)
    course = np.deg2rad(runway.true_course_deg)
    tail, cross = truth.tailwind_mps + rng.normal(0.0, family.wind_error_mps), rng.normal(0.0, 4.0)
    ones = np.ones(len(height_m))
    return {
        "indicated_airspeed_mps": speed,
        "wind_north_mps": (tail * np.cos(course) - cross * np.sin(course)) * ones,
        "wind_east_mps": (tail * np.sin(course) + cross * np.cos(course)) * ones,
    }


def _with(flight: Flight, topic: str, every: int, **columns: FloatArray) -> Flight:
    like = flight["ins"].take(slice(None, None, every))
    found = {
        name: Column(values[::every] > 0.5 if name.startswith("gear") else values[::every])
        for name, values in columns.items()
    }
    made = Table(topic, like.time_ns, found, like.record_index, like.device_time_ns)
    return replace(flight, tables={**flight.tables, topic: made})
