"""Steps back of topics that are made of several messages, each judged in its own order.

A filter stamps a record when its cycle began and writes it behind others: the records of each message rise, and mixed
they step back at every cycle though no clock does.
"""

import numpy as np

from groundstation.base.records import RecordBatch


class StepsBySource:
    """Count of the rows whose device time is before that of the row before of the same source.

    ``counts`` has the topics whose rows name their source.
    """

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}
        self._last_ns: dict[tuple[str, int], int] = {}

    def add(self, batch: RecordBatch) -> None:
        """Count the steps back of a batch, the one at its beginning among them."""
        if batch.sources is None:
            return
        self.counts.setdefault(batch.topic, 0)
        timed = batch.device_time_ns.mask
        for source in np.unique(batch.sources).tolist():
            time_ns = batch.device_time_ns.values[timed & (batch.sources == source)]
            if not len(time_ns):
                continue
            before_ns = self._last_ns.get((batch.topic, source), int(time_ns[0]))
            self.counts[batch.topic] += int(np.count_nonzero(np.diff(time_ns, prepend=before_ns) < 0))
            self._last_ns[batch.topic, source] = int(time_ns[-1])
