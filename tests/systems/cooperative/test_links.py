"""Ranges behind the figures of links, and bounds that are worked out only where they judge."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import load_session
from groundstation.systems.cooperative import estimate
from groundstation.systems.cooperative.arrays import CooperativeLinks, CooperativeTracks
from groundstation.systems.cooperative.estimate import estimate_session
from groundstation.systems.cooperative.geometry import bound_of
from groundstation.systems.cooperative.tracks import AlgorithmRun
from tests.systems.cooperative.example import believed

NAMES = ("centralised", "smoothed")


def test_ranges_fit_the_answer_when_its_own_clocks_are_taken_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the clocks that the filter knew at the time 11.4 m are left of 10 m of noise."""
    bounds: list[str] = []

    def counted(*given: Any) -> AlgorithmRun:
        bounds.append(str(given[-1]))
        return bound_of(*given)

    monkeypatch.setattr(estimate, "bound_of", counted)
    scenario = replace(load_session("local-three-one-point"), duration_s=100.0)
    session = simulate_session(scenario, 4711).session
    answer, _ = estimate_session(session, settings=believed(scenario), algorithms=NAMES)
    (links,) = (one for one in answer.figures if isinstance(one, CooperativeLinks))
    (tracks,) = (one for one in answer.figures if isinstance(one, CooperativeTracks))
    assert links.range_m is not None
    away = []
    for receiver, source in {*zip(links.receiver.tolist(), links.source.tolist(), strict=True)}:
        mine = (links.receiver == receiver) & (links.source == source)
        ends = []
        for name in (receiver, source):
            rows = (tracks.vehicle == name) & (tracks.algorithm == "smoothed")
            columns = [column[rows] for column in (tracks.x_m, tracks.y_m, tracks.z_m)]
            at_s = links.time_s[mine]
            point = next((one.position_m for one in session.points if one.name == name), (0.0, 0.0, 0.0))
            ends.append([np.interp(at_s, tracks.time_s[rows], column) for column in columns] if rows.any() else point)
        line = [here - there for here, there in zip(*ends, strict=True)]
        away.append(np.sqrt(sum(one**2 for one in line)) - links.range_m[mine])
    assert np.sqrt(np.mean(np.concatenate(away) ** 2)) == pytest.approx(10.0, abs=0.7)
    assert len(bounds) == 1, "the smoother's bound judges errors, which need a truth"
