"""Pool of one-way taxis through the whole heading estimator.

Fleets of docs/evidence/installation.md draw from it.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.results.figures import FigureData
from groundstation.simulation.taxi import draw_case, simulate_taxi, taxi_flight
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.gates_answer import STANDSTILL_SPEED, WHOLE
from groundstation.systems.known import AircraftData
from groundstation.systems.study import RunStore
from groundstation.tables.phases import flight_phases

Progress = Callable[[str], None]


@dataclass(frozen=True)
class TaxiOfPool:
    """Result of the estimator on one taxi without wind, mounting and sideslip.

    Parameters
    ----------
    error_deg : float
        Estimate minus truth.
    sigma_deg, half_width_deg : float
        By this taxi alone.
    track_deg : float
        Direction.
    failed : tuple of str
        Required gates that did not pass, but for that on the whole half width.
    """

    error_deg: float
    sigma_deg: float
    half_width_deg: float
    track_deg: float
    failed: tuple[str, ...]

    @property
    def passes_standstill(self) -> bool:
        """Tell whether the mean velocity at standstill is within the limit."""
        return STANDSTILL_SPEED not in self.failed


def draw_taxi(seed: int, number: int) -> TaxiOfPool:
    """Draw run ``number`` of the pool of a seed and pass it through the estimator."""
    rng = np.random.default_rng((seed, number))
    case = replace(
        draw_case(rng, "continuous"),
        segments_s=(float(rng.uniform(60.0, 120.0)),),
        turns_deg=(),
        curve_dps=0.0,
        correlated_mps=float(rng.uniform(0.003, 0.015)),
        white_mps=float(rng.uniform(0.01, 0.04)),
        is_arm_known=True,
    )
    run = simulate_taxi(case, rng)
    flight = taxi_flight(run)
    found = estimate_heading_error(
        flight, aircraft=AircraftData(antenna_arm_m=case.antenna_arm_m), phases=flight_phases(flight)
    )
    return taxi_of(found, float(wrap_180(found.error_deg - run.error_at(found.reference_time_s or 0.0))))


def taxi_of(found: HeadingResult, error_deg: float) -> TaxiOfPool:
    """Return the part of an answer that the pool keeps."""
    (taxi,) = (part for part in found.interval_parts if part.name == "taxi")
    failed = tuple(gate.name for gate in found.gates if gate.required and gate.state != "passed" and gate.name != WHOLE)
    return TaxiOfPool(error_deg, taxi.sigma_deg, taxi.half_width_deg, found.segments[0].mean_track_deg, failed)


def draw_pool(
    seed: int,
    runs: int,
    progress: Progress | None = None,
    *,
    kept: RunStore[TaxiOfPool] | None = None,
    is_over: Callable[[], bool] = lambda: False,
) -> tuple[TaxiOfPool, ...]:
    """Draw the first ``runs`` runs of a pool, fewer where time is over.

    Runs in ``kept`` are not made again.
    """
    made: list[TaxiOfPool] = []
    for number in range(runs):
        found = None if kept is None else kept.get(f"pool-{seed}", number)
        if found is None:
            if is_over():
                break
            found = draw_taxi(seed, number)
            if kept is not None:
                kept.put(f"pool-{seed}", number, found)
            if progress is not None:
                progress(f"taxi {number + 1} of {runs}")
        made.append(found)
    return tuple(made)


def pool_figure(pool: Sequence[TaxiOfPool]) -> FigureData:
    """Return the pool as a table."""
    columns = {
        name: np.array([getattr(one, name) for one in pool], dtype=np.float64)
        for name in ("error_deg", "sigma_deg", "half_width_deg", "track_deg")
    }
    failed = np.array([" ".join(one.failed) for one in pool], dtype=np.str_)
    return FigureData("installation_pool", columns | {"failed": failed}, dict.fromkeys(columns, 5))
