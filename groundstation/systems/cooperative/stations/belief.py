"""Sigmas believed of INS and clocks, held against what the session shows.

The stations are tested against these sigmas: where INS or clocks are worse than believed, a right station would be
refused. The duals of the smoother tell: those of one component, squared and over their expected square, estimate the
factor of its variance (variance components: Foerstner, Ein Verfahren zur Schaetzung von Varianz- und
Kovarianzkomponenten, 1979). The stations are free in it, so that a station that is off does not pass for a bad INS.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import LOCAL
from groundstation.systems.cooperative.settings import CooperativeSettings, InsBelief
from groundstation.systems.cooperative.smoother.smoothed import SmoothedProblem
from groundstation.systems.cooperative.stations.information import StationInformation

SURE_SIGMAS = 1.0  # of an estimated factor, which it must exceed 1 by
LEAST_FREEDOM = 0.5  # independent numbers, below which a component tells nothing


def belief_factors(
    prepared: Prepared, solved: SmoothedProblem, information: StationInformation
) -> dict[str, tuple[float, float]]:
    """Return the factor of each believed variance, with the independent numbers behind it."""
    found: dict[str, list[float]] = {}
    response = information.response
    numbers, _, _, _ = np.linalg.lstsq(information.matrix, information.score, rcond=1e-9)
    value, axes = np.linalg.eigh(information.matrix)
    seen = value > 1e-9 * max(float(value[-1]), 1e-30)
    root = axes[:, seen] / np.sqrt(value[seen] * information.repetition)
    dual = response.duals[..., -1] - response.duals[..., :-1] @ numbers
    taken = response.duals[..., :-1] @ root  # what the free stations take off the covariance of the duals
    problem, layout = solved.problem, solved.layout
    for number, vehicle in enumerate(prepared.vehicles):
        if not isinstance(vehicle, Aircraft):
            continue
        group, index, first = layout.of_vehicle[number].tolist()
        for name, states, of_start in _components(vehicle):
            at = first + states
            if of_start:
                variance = problem.variance[at]
                square = float((variance * dual[0, at] ** 2).sum())
                expected = float((variance * (response.spread[0][at] - (taken[0, at] ** 2).sum(axis=1))).sum())
            else:
                noise = problem.noise[group][:, index][:, states[:, None], states]
                square = float(np.einsum("ti,tij,tj->", dual[1:, at], noise, dual[1:, at]))
                off = float(np.einsum("tic,tij,tjc->", taken[1:, at], noise, taken[1:, at]))
                expected = float(response.spread[1 + group][index][states[:, None], states].sum()) - off
            total = found.setdefault(name, [0.0, 0.0])
            total[0] += square
            total[1] += expected
    return {name: (square / freedom, freedom) for name, (square, freedom) in found.items() if freedom > LEAST_FREEDOM}


def with_factors(settings: CooperativeSettings, factors: dict[str, tuple[float, float]]) -> CooperativeSettings:
    """Return settings whose sigmas are raised where the session shows more than was believed."""
    raised = {
        name: getattr(settings.ins, name) * float(np.sqrt(factor))
        for name, (factor, freedom) in factors.items()
        if factor > 1.0 + SURE_SIGMAS * np.sqrt(2.0 / freedom)
    }
    return replace(settings, ins=replace(settings.ins, **raised)) if raised else settings


def raised_sigmas(before: InsBelief, after: InsBelief) -> dict[str, float]:
    """Return by which factor sigmas were raised."""
    return {
        name: getattr(after, name) / value
        for name, value in vars(before).items()
        if isinstance(value, float) and value > 0.0 and getattr(after, name) > value * (1.0 + 1e-9)
    }


def _components(vehicle: Aircraft) -> Iterator[tuple[str, Int64Array, bool]]:
    """Yield the fields of the belief with their states, at the start or in motion."""
    height, clock = vehicle.height, vehicle.clock
    yield "position_m", np.array([0, 1]), True
    yield "velocity_mps", np.array([2, 3]), True
    if vehicle.model == LOCAL:
        yield "velocity_mps", np.arange(4), False
    else:
        yield "tilt_arcsec", np.array([4, 5]), True
        yield "azimuth_arcmin", np.array([6]), True
        yield "gyro_dph", np.array([7, 8, 9]), True
        yield "gyro_dph", np.arange(10), False
    yield "baro_m", np.array([height]), True
    yield "baro_m", np.array([height]), False
    yield "clock_m", np.array([clock]), True
    yield "clock_mps", np.array([clock + 1]), True
    yield "clock_mps", np.array([clock, clock + 1]), False
    if vehicle.receiver_clock != clock:
        receiver = vehicle.receiver_clock
        yield "clock_m", np.array([receiver]), True
        yield "clock_mps", np.array([receiver + 1]), True
        yield "clock_mps", np.array([receiver, receiver + 1]), False
