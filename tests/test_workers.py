"""A worker process works as a process of the command line does, on its share of the cores."""

import gc
import os

import pytest

from groundstation.base import halves
from groundstation.base.dataclasses import dataclass
from groundstation.base.garbage import NEW_OBJECTS
from groundstation.base.halves import cores, share_cores
from groundstation.pipeline.many_flights.processes.workers import side_by_side
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Listener, silent


@dataclass(frozen=True)
class Job:
    """Job that tells how its process is set up."""

    log: str = "log"
    name: str = "log"


def told(job: Job, listen: Listener) -> Outcome:
    return Outcome(job.log, "done", f"{gc.get_threshold()[0]} {cores()}")


def test_a_worker_searches_for_garbage_as_rarely_as_a_run_does() -> None:
    """It searched once in 700 new objects, through all that it had imported: a sixth of the time of two workers."""
    ((_, outcome),) = side_by_side([(0, Job())], told, workers=1, listen=silent)
    assert outcome.text.split()[0] == str(NEW_OBJECTS)


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="the system does not tell the cores of a process")
def test_two_workers_have_half_the_cores_each() -> None:
    ((_, outcome),) = side_by_side([(0, Job())], told, workers=2, listen=silent)
    assert outcome.text.split()[1] == str(max(cores() // 2, 1))


def test_a_share_is_at_least_one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(halves, "_sharing", [1])
    whole = cores()
    share_cores(10 * whole)
    assert cores() == 1
    share_cores(0)
    assert cores() == whole
