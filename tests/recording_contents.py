"""What an .rrd holds, read back with Rerun's own reader."""

from pathlib import Path

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader


class Contents:
    """What a recording holds: rows by entity, timelines, static text."""

    def __init__(self, path: Path) -> None:
        reader = RrdReader(path)
        self.store, self.blueprints = reader.recordings()[0], reader.blueprints()
        self.timelines: set[str] = set()
        self.batches: dict[str, list[pa.RecordBatch]] = {}
        self.fixed: dict[str, list[pa.RecordBatch]] = {}
        for chunk in reader.stream():
            self.timelines |= set(chunk.timeline_names)
            place = self.fixed if chunk.is_static else self.batches
            place.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())

    def scalars(self, entity: str) -> tuple[np.ndarray, np.ndarray]:
        """Flight time in nanoseconds (of a fleet: flight numbers) and values, shapes (n,) and (n, k), in order."""
        return self._column(entity, "Scalars:scalars")

    def band(self, entity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times as of :meth:`scalars`, the line in the middle of a filled band and its half width, shapes (n,)."""
        time_ns, middle = self._column(entity, "Measurements:values")
        return time_ns, middle[:, 0], np.sqrt(self._column(entity, "Measurements:variances")[1][:, 0])

    def times(self, entity: str) -> np.ndarray:
        """Times of the rows of an entity, as of :meth:`scalars`, shape (n,)."""
        timeline = next(name for name in ("flight_time", "flight_number") if name in self.timelines)
        return np.concatenate([np.asarray(batch.column(timeline).cast(pa.int64())) for batch in self.batches[entity]])

    def _column(self, entity: str, name: str) -> tuple[np.ndarray, np.ndarray]:
        timeline = next(name for name in ("flight_time", "flight_number") if name in self.timelines)
        times, values = [], []
        for batch in self.batches[entity]:
            times.append(np.asarray(batch.column(timeline).cast(pa.int64())))
            flat = batch.column(name).flatten().to_numpy(zero_copy_only=False)
            values.append(flat.reshape(batch.num_rows, -1))
        order = np.argsort(np.concatenate(times), kind="stable")
        return np.concatenate(times)[order], np.concatenate(values)[order]

    def text(self, entity: str) -> str:
        """Text of a document."""
        return next(
            str(batch.column("TextDocument:text")[0].as_py()[0])
            for batch in self.fixed[entity]
            if "TextDocument:text" in batch.schema.names
        )
