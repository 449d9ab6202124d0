"""Crew of a run: a cluster, processes side by side or each apart, or this process alone."""

import math
from functools import partial

from groundstation.pipeline.many_flights.processes.apart import outcomes_apart
from groundstation.pipeline.many_flights.processes.confined import ProcessLimits
from groundstation.pipeline.many_flights.processes.crew import Crew, in_turn
from groundstation.pipeline.many_flights.processes.workers import RESULTS_PER_PROCESS, TASKS_PER_PROCESS, side_by_side
from groundstation.pipeline.one_flight.progress import Listener


def crew_for(
    scheduler: str,
    workers: int,
    logs: int,
    listen: Listener,
    timeout_s: float = math.inf,
    bounds: ProcessLimits | None = None,
    *,
    only_results: bool = False,
) -> Crew:
    """Choose who does the work: a cluster, processes, or this process alone.

    This process alone works where there is little to do and no limit of time. With ``only_results``, which leave
    nothing behind in a process, each process serves more logs.
    """
    if bounds is not None:
        return partial(outcomes_apart, workers=workers, listen=listen, bounds=bounds)
    if scheduler:
        from groundstation.pipeline.many_flights.processes.cluster import on_cluster

        return partial(on_cluster, scheduler=scheduler, timeout_s=timeout_s)
    if min(workers, logs) <= 1 and logs <= TASKS_PER_PROCESS and math.isinf(timeout_s):
        return partial(in_turn, listen=listen)
    tasks = RESULTS_PER_PROCESS if only_results else TASKS_PER_PROCESS
    return partial(
        side_by_side, workers=min(workers, logs), listen=listen, timeout_s=timeout_s, tasks_per_process=tasks
    )


def is_elsewhere(crew: Crew) -> bool:
    """Tell whether the jobs of a crew run in other processes, and this one waits for them."""
    return not (isinstance(crew, partial) and crew.func is in_turn)
