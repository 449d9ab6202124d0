"""Distance in time of logs that the times of their files place, as their motion shows it."""

from collections.abc import Sequence
from typing import NamedTuple

from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.several_logs.answer import JoinedLog


class SeenByMotion(NamedTuple):
    """GNSS latency of a trajectory over two logs, s, with the logs that it is between."""

    latency_s: float
    sigma_s: float
    unit: JoinedLog
    gnss: JoinedLog


def seen_by_motion(logs: Sequence[JoinedLog], found: StatesAlongTheFlight | None) -> SeenByMotion | None:
    """Return how well the clocks agree, by the GNSS latency of a trajectory over both logs.

    None where it is another log, or several, that file time alone places, and where no trajectory shows it.
    """
    latency = None if found is None or not found.is_reference else found.gnss_latency
    unknown = [log for log in logs if log.method == "file_time"]
    if found is None or latency is None or len(unknown) != 1:
        return None
    unit, gnss = (_log_of(logs, topic) for topic in (found.unit_topic, found.gnss_topic))
    if unit is gnss or unknown[0] not in (unit, gnss):
        return None
    return SeenByMotion(*latency, unit, gnss)


def _log_of(logs: Sequence[JoinedLog], topic: str) -> JoinedLog:
    """Return the log that a topic of the flight comes from."""
    labelled = (log for log in logs if log.label and topic.endswith(f".{log.label}"))
    return next(labelled, next(log for log in logs if not log.label))
