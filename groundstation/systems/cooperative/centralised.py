"""Centralised extended Kalman filter of all vehicles.

It has 7 k states in a local frame, 13 k (15 k) in the global one. A vehicle's block is moved on when a measurement or
an output asks for it: noise of different vehicles is independent, so that blocks may stand at different times. Vehicles
that are not there yet keep their start. Ground points whose own position is uncertain are constant states. Dead
reckoning is the same filter without measurements.

A range between two aircraft is linearised, value and direction, about a reference place of each: its dead reckoning
less an offset, at first 0. While the line between the estimates lies within ``KNOWN_WRONG_SIGMAS`` claimed sigmas of
the reference line, across it, the reference stays: directions that follow the estimate tell of a turn of the whole
group, which ranges inside it cannot see (first-estimates Jacobian: Huang, Mourikis and Roumeliotis, 2010). Beyond, the
reference is known to be wrong and both its ends move to the estimate. Ranges to points and satellites do see a turn of
the group: with any of them a range is linearised at the estimate, unless the settings say otherwise, for the curvature
that the reference neglects then costs more than it saves. A direction that stays while the value is taken at the
estimate is no such filter: for aircraft in line its sign across the line may be the wrong one, and every update then
drives the estimate further away.

Source: Kalman, A new approach to linear filtering and prediction problems, 1960; sequential use of simultaneous
measurements: Maybeck, Stochastic Models, Estimation, and Control, volume 1, 1979, section 5.6.
"""

import numpy as np

from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.joint import Joint, work
from groundstation.systems.cooperative.loop_types import POINT, SATELLITE, LoopRules
from groundstation.systems.cooperative.messages import report_bytes
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.timeline import SAME_TIME_S, timeline
from groundstation.systems.cooperative.tracks import AlgorithmRun, finished, log_for


def run_centralised(
    prepared: Prepared, settings: CooperativeSettings, *, uses_measurements: bool = True, innovates: bool = True
) -> AlgorithmRun:
    """Run the centralised filter, or without measurements dead reckoning.

    Parameters
    ----------
    prepared : Prepared
    settings : CooperativeSettings
    uses_measurements : bool
        False: the start and the noise alone.
    innovates : bool
        False: measurements shrink the covariance and leave the state where it is, as if each were predicted exactly.
    """
    together = settings.update == "simultaneous"
    items = timeline(prepared, settings, together=together)
    rules = LoopRules(
        settings.gate_sigma, together, is_about_reckoning(prepared, settings), uses_measurements, innovates
    )
    log = log_for(prepared, items)
    work(prepared.fleet, prepared.points, prepared.events, items, rules, _start(prepared), log)
    messages = reports(prepared, settings) if uses_measurements else {}
    name = "centralised" if uses_measurements else "dead_reckoning"
    return finished(prepared, items, log, name, settings.update, messages)


def _start(prepared: Prepared) -> Joint:
    """Return the start state and covariance of all vehicles and uncertain points.

    A vehicle that is not there yet keeps its start.
    """
    sigmas = prepared.points.sigma_m[prepared.points.uncertain >= 0]
    starts = [vehicle.start() for vehicle in prepared.vehicles]
    sizes = [len(x) for x, _ in starts]
    places = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    variances = [np.diag(P) for _, P in starts]
    x = np.concatenate([x for x, _ in starts] + [np.zeros(2 * len(sigmas))])
    P = np.diag(np.concatenate([*variances, np.repeat(sigmas, 2) ** 2]))
    k = len(prepared.vehicles)
    first_s = np.array([vehicle.first_s for vehicle in prepared.vehicles])
    return Joint(places, x, np.ascontiguousarray(P), first_s, np.zeros((k, 3)), np.zeros(k, dtype=np.int64))


def is_about_reckoning(prepared: Prepared, settings: CooperativeSettings) -> bool:
    """Tell whether ranges between aircraft are linearised about their dead reckoning."""
    if settings.derivatives == "auto":
        return not np.isin(prepared.events.kind, (POINT, SATELLITE)).any()
    return settings.derivatives == "reckoning"


def reports(prepared: Prepared, settings: CooperativeSettings) -> dict[str, tuple[int, int]]:
    """Count the vehicles' reports to the centre and their bytes.

    Once a frame each sends its dead reckoning and what it measured.
    """
    events = prepared.events
    frame = np.floor((events.time_s + SAME_TIME_S) / settings.frame_s).astype(np.int64)
    report, ranges = np.unique(frame * len(prepared.vehicles) + events.receiver, return_counts=True)
    found: dict[str, tuple[int, int]] = {}
    for who, vehicle in enumerate(prepared.vehicles):
        mine = ranges[report % len(prepared.vehicles) == who].tolist()
        if mine:
            found[vehicle.name] = (len(mine), sum(report_bytes(count) for count in mine))
    return found
