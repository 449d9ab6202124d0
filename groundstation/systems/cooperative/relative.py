"""Covariances of the places of vehicles to one another.

They come from the algorithms that keep what two vehicles have in common. A filter of one vehicle alone claims nothing
of its error together with another's.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.expected_honesty import PairwiseCovariances
from groundstation.systems.cooperative.filters.steps import steps
from groundstation.systems.cooperative.joint_covariance import joint_covariances, used_events
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun

Relative = dict[tuple[int, int], tuple[FloatArray, FloatArray]]
_Instant = tuple[float, dict[tuple[int, int], FloatArray]]


def relative_covariances(prepared: Prepared, settings: CooperativeSettings, run: AlgorithmRun) -> Relative:
    """Return the claimed horizontal covariance of the place of one vehicle to another.

    Parameters
    ----------
    prepared : Prepared
        Of a session in a local frame, where the axes of all vehicles are the same.
    settings : CooperativeSettings
    run : AlgorithmRun

    Returns
    -------
    dict of (vehicle, vehicle) to (time_s (n,), covariance (n, 2, 2))
        Empty for an algorithm that claims none.
    """
    if run.algorithm == "dead_reckoning":
        return _independent(run)
    if run.algorithm == "smoothed":
        return dict(run.relative)
    instants = {"centralised": _centralised, "pairwise": _pairwise}.get(run.algorithm)
    found: dict[tuple[int, int], list[tuple[float, FloatArray]]] = {}
    for at_s, pairs in instants(prepared, settings, run) if instants else ():
        for pair, covariance in pairs.items():
            found.setdefault(pair, []).append((at_s, covariance))
    return {
        pair: (np.array([at_s for at_s, _ in rows]), np.array([covariance for _, covariance in rows]))
        for pair, rows in found.items()
    }


def _independent(run: AlgorithmRun) -> Relative:
    found: Relative = {}
    for (i, one), (j, two) in combinations(enumerate(run.tracks), 2):
        time_s, at, to = np.intersect1d(one.time_s, two.time_s, return_indices=True)
        found[i, j] = time_s, one.horizontal_m2[at] + two.horizontal_m2[to]
    return found


def _centralised(prepared: Prepared, settings: CooperativeSettings, run: AlgorithmRun) -> Iterator[_Instant]:
    for at_s, joint in joint_covariances(prepared, settings, run):
        first = [place.start for place in joint.places]
        here = [number for number, now_s in enumerate(joint.times) if abs(now_s - at_s) < 1e-9]
        pairs = {}
        for i, j in combinations(here, 2):
            one, two = slice(first[i], first[i] + 2), slice(first[j], first[j] + 2)
            pairs[i, j] = joint.P[one, one] + joint.P[two, two] - joint.P[one, two] - joint.P[two, one]
        yield at_s, pairs


def _pairwise(prepared: Prepared, settings: CooperativeSettings, run: AlgorithmRun) -> Iterator[_Instant]:
    filters, is_used = PairwiseCovariances(prepared, run.tracks), used_events(prepared, run)
    here: list[int] = []
    for at_s, what in steps(prepared, settings, together=False):
        if isinstance(what, int):
            filters.advance(what, at_s)
            filters.output(what)
            here = [one for one in here if abs(filters.joint.times[one] - at_s) < 1e-9]
            yield at_s, {(one, what): filters.relative_m2(one, what) for one in here}
            here.append(what)
        elif is_used[what[0].number]:
            filters.use(what[0])
