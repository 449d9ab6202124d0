"""Random geometries without control beside the published figures of speed control.

The source gives no geometry. The share of geometries that meet its figures without any control says how much it proves
that one with control does.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from groundstation.chapters.parts import Section
from groundstation.methods.intervals import share_interval
from groundstation.results.figures import FigureData
from groundstation.systems.planning.session.accuracy import EAST, NORTH
from groundstation.systems.planning.session.laws import PlannedSession
from groundstation.systems.planning.session.scenario import SessionPlan
from groundstation.systems.study import section, table

SIDES_M = (2_000.0, 4_000.0, 10_000.0, 40_000.0)
DRAWS = 400
LEAST_M = 100.0  # nobody flies nearer to the user


def random_table(plan: SessionPlan, published_m: Sequence[float], factor: float, draws: int, seed: int) -> FigureData:
    """Tabulate the share of random geometries near the published figures without control.

    Parameters
    ----------
    plan : SessionPlan
        The first aircraft is the user, and the others are exact.
    published_m : two floats
        Two sigma north and east.
    factor : float
        Near: both within so many times.
    draws, seed : int
        Of each side of the square in which the exact aircraft stand, the user in its middle.
    """
    rows = []
    for side_m in SIDES_M:
        rng = np.random.default_rng((seed, int(side_m)))
        found = np.array([_uncontrolled_m(_drawn(plan, side_m, rng)) for _ in range(draws)])
        ratio = found / np.asarray(published_m)
        near = int(((ratio >= 1.0 / factor) & (ratio <= factor)).all(axis=1).sum())
        better = int((ratio <= factor).all(axis=1).sum())
        low, high = share_interval(near, draws)
        rows.append((side_m, draws, near / draws, low, high, better / draws, *np.median(found, axis=0).tolist()))
    names = (
        *("square_m", "draws", "share_within_factor_two", "share_low", "share_high", "share_so_or_better"),
        *("median_two_sigma_north_m", "median_two_sigma_east_m"),
    )
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    digits = {"square_m": 0, "median_two_sigma_north_m": 1, "median_two_sigma_east_m": 1}
    return FigureData("control_random", columns, digits)


def _drawn(plan: SessionPlan, side_m: float, rng: np.random.Generator) -> SessionPlan:
    user, *others = plan.aircraft
    placed = []
    for one in others:
        north_m, east_m = 0.0, 0.0
        while np.hypot(north_m, east_m) < LEAST_M:
            north_m, east_m = rng.uniform(-0.5 * side_m, 0.5 * side_m, 2).tolist()
        placed.append(replace(one, north_m=user.north_m + north_m, east_m=user.east_m + east_m))
    return replace(plan, aircraft=(user, *placed), separation_m=0.0)


def _uncontrolled_m(plan: SessionPlan) -> tuple[float, float]:
    """Two sigma north and east at the end, without control."""
    session = PlannedSession(plan)
    P = session.model.accuracy(session.motion.paths(session.motion.uncontrolled).position_m).covariance[-1]
    return 2.0 * float(np.sqrt(P[NORTH, NORTH])), 2.0 * float(np.sqrt(P[EAST, EAST]))


def random_section(data: FigureData) -> Section:
    """Return the table on a page, with what it shows."""
    shares = ", ".join(f"{100.0 * share:.0f} %" for share in data["share_within_factor_two"])
    return section(
        "How little the figures of speed control prove",
        "Three exact aircraft at random in a square about the user, who controls nothing: the share of such geometries "
        f"whose 2 sigma north and east are both within a factor of two of the published ones is {shares}, by side of "
        "the square. A geometry that meets them with control proves little.",
        table(data),
    )
