"""Steps back of topics that are made of several messages, each judged in its own order.

A filter stamps a record when its cycle began and writes it behind others: the records of each message rise, and mixed
they step back at every cycle though no clock does.
"""

import numpy as np

from groundstation.base.records import Int64Array, RecordBatch
from groundstation.integrity.time_passes import MOST_SOURCES, count_back, passes_over


class StepsBySource:
    """Count of the rows whose device time is before that of the row before of the same source.

    ``counts`` has the topics whose rows name their source.
    """

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}
        self._last_ns: dict[str, dict[int, int]] = {}  # of each source of a topic

    def add(self, batch: RecordBatch) -> None:
        """Count the steps back of a batch, the one at its beginning among them."""
        if batch.sources is None:
            return
        self.counts.setdefault(batch.topic, 0)
        time_ns, sources, timed = batch.device_time_ns.values, batch.sources, batch.device_time_ns.present
        if timed is not None:
            time_ns, sources = time_ns[timed], sources[timed]
        if len(time_ns):
            self.counts[batch.topic] += _count(time_ns, sources, self._last_ns.setdefault(batch.topic, {}))


def _count(time_ns: Int64Array, sources: Int64Array, last_ns: dict[int, int]) -> int:
    """Count the steps back of some rows.

    ``last_ns`` are the last times of each source before them, and then theirs.
    """
    if len(last_ns) < MOST_SOURCES and passes_over(time_ns, sources):
        known, last = np.zeros((2, MOST_SOURCES + 1), dtype=np.int64)
        known[: len(last_ns)], last[: len(last_ns)] = list(last_ns), list(last_ns.values())
        back = count_back(time_ns, sources, known, last, len(last_ns))
        if back >= 0:
            count = int(last[-1])
            last_ns.update(zip(known[:count].tolist(), last[:count].tolist(), strict=True))
            return back
    back = 0
    is_one = sources.strides == (0,)
    for source in sources[:1].tolist() if is_one else np.unique(sources).tolist():
        own_ns = time_ns if is_one else time_ns[sources == source]
        back += int(np.count_nonzero(own_ns[1:] < own_ns[:-1]))
        back += int(own_ns[0]) < last_ns.get(source, int(own_ns[0]))
        last_ns[source] = int(own_ns[-1])
    return back
