"""Decentralised filter with stored pairwise cross-covariances.

It is close to the centralised one, at the price of an answer to each message.

Each vehicle i keeps its own state and, for every other j, a factor s_ij so that the cross-covariance is s_ij s_ji'. It
moves the factor on and corrects it by itself; only the two vehicles of a range exchange anything, and they update as
one filter of both. What one of them alone sees corrects nobody else (suboptimal, yet the factors stay right). Factors
towards third vehicles are scaled by P_i(after) P_i(before)^-1: that is the method's one approximation. The receiver
answers in the same slot: latency has no meaning here.

Source: Luft, Schubert, Roumeliotis and Burgard, Recursive decentralized localization for multi-robot systems with
asynchronous pairwise communication, International Journal of Robotics Research 37(10), 2018, algorithm 1 and section 4.
"""

import numpy as np

from groundstation.systems.cooperative.error_map import blocks, spectral_radius, unit_rows, windows
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import PEER, rows_for
from groundstation.systems.cooperative.messages import pairwise_bytes
from groundstation.systems.cooperative.pair import Members, room_for, run_pairs
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.timeline import timeline
from groundstation.systems.cooperative.tracks import AlgorithmRun, finished, log_for


def run_pairwise(prepared: Prepared, settings: CooperativeSettings) -> AlgorithmRun:
    """Run the filter with pairwise cross-covariances; sequential by its nature."""
    items = timeline(prepared, settings, together=False)
    log, fleet, unit = log_for(prepared, items), prepared.fleet, unit_rows(prepared.fleet, settings.map_window_s)
    k, n, _ = unit.shape
    members = Members(
        np.array([vehicle.first_s for vehicle in prepared.vehicles]),
        np.zeros((k, n)),
        np.zeros((k, n, n)),
        np.zeros((k, k, n, n)),
        np.zeros((k, k), dtype=np.bool_),
        unit.copy(),
        np.zeros(k, dtype=np.int64),
    )
    for who, vehicle in enumerate(prepared.vehicles):
        members.x[who, : vehicle.size], members.P[who, : vehicle.size, : vehicle.size] = vehicle.start()
    room, rows = room_for(n, unit.shape[2]), rows_for(n)
    times: list[float] = []
    radii: list[float] = []
    for begin, end in windows(items, settings.map_window_s):
        if begin > 0:
            times.append(float(items.time_s[begin]))
            radii.append(spectral_radius(blocks(members.map_rows, fleet)))
        members.map_rows[:] = unit
        given = fleet, prepared.points, prepared.events, items
        run_pairs(*given, begin, end, settings.gate_sigma, members, room, rows, log)
    return finished(prepared, items, log, "pairwise", "sequential", _messages(prepared), (times, radii))


def _messages(prepared: Prepared) -> dict[str, tuple[int, int]]:
    """Count the messages: with each range the source sends its state, the receiver answers."""
    events, vehicles = prepared.events, prepared.vehicles
    is_peer = events.kind == PEER
    pairs, counts = np.unique(np.stack([events.receiver[is_peer], events.source[is_peer]]), axis=1, return_counts=True)
    found: dict[str, tuple[int, int]] = {}
    for receiver, source, count in zip(*pairs.tolist(), counts.tolist(), strict=True):
        sizes = pairwise_bytes(vehicles[receiver].size, vehicles[source].size)
        for who, size in zip((source, receiver), sizes, strict=True):
            messages, total = found.get(vehicles[who].name, (0, 0))
            found[vehicles[who].name] = (messages + count, total + count * size)
    return found
