"""Recorder of a fleet for Rerun: a row is a flight, with its place on the timelines."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

from groundstation.base.records import Int64Array
from groundstation.results.fleet import FleetResults
from groundstation.systems.system import Systems
from groundstation.viewer.colours import Colour, for_states
from groundstation.viewer.names import clean_text
from groundstation.viewer.recorder import NO_SYSTEMS, UTC, Recorder
from groundstation.viewer.series import FloatArray

FLIGHT_NUMBER = "flight_number"


class FleetRecorder(Recorder):
    """Recorder whose rows are flights: it takes numbers of flights in place of times.

    Flights are numbered from 1 in order of their start (``utc``); those without a time come after them and have no
    place but their number.

    Parameters
    ----------
    stream : rerun.RecordingStream
    fleet : FleetResults
    systems : Systems, optional
    """

    def __init__(self, stream: rr.RecordingStream, fleet: FleetResults, systems: Systems = NO_SYSTEMS) -> None:
        starts = fleet.flights["start_utc"].astype("datetime64[ns]")
        ids = fleet.flights["flight_id"].astype(np.str_)
        self.order: Int64Array = np.lexsort((ids, starts.astype(np.int64), np.isnat(starts)))
        self.starts, self.timed = starts[self.order], int((~np.isnat(starts)).sum())
        self._number = {name: place + 1 for place, name in enumerate(ids[self.order].tolist())}
        super().__init__(stream, 0, self.timed > 0, systems)

    def time_ns(self, flight_seconds: ArrayLike) -> Int64Array:
        """Numbers of flights as they stand on the axes of plots."""
        return np.rint(np.asarray(flight_seconds, dtype=np.float64)).astype(np.int64)

    def numbers(self, flight_ids: NDArray[np.str_]) -> Int64Array:
        """Return numbers of flights."""
        return np.array([self._number[name] for name in flight_ids.tolist()], dtype=np.int64)

    def places(self, flight_ids: NDArray[np.str_]) -> FloatArray:
        """Numbers of flights as places on an axis of a plot."""
        return self.numbers(flight_ids).astype(np.float64)

    def set_flight(self, number: int) -> None:
        """Put everything logged next at a flight, until ``stream.reset_time``."""
        self.stream.reset_time()
        self.stream.set_time(FLIGHT_NUMBER, sequence=number)
        if number <= self.timed:
            self.stream.set_time(UTC, timestamp=self.starts[number - 1])

    def indexes(self, time_ns: Int64Array) -> list[rr.TimeColumn]:
        """Return time columns of flights that all have a time, or all have none."""
        columns = [rr.TimeColumn(FLIGHT_NUMBER, sequence=time_ns)]
        if len(time_ns) and time_ns[0] <= self.timed:
            columns.append(rr.TimeColumn(UTC, timestamp=self.starts[time_ns - 1]))
        return columns

    def lane(self, path: str, time_ns: Int64Array, states: Sequence[str], colours: Mapping[str, Colour]) -> None:
        """Log one lane of states, a flight each.

        The last flight is as wide as if another followed.
        """
        shown = np.array([clean_text(state) for state in states])
        shades = for_states((state for state in shown.tolist() if state), colours)
        self.static(path, rr.StateConfiguration(values=list(shades), colors=list(shades.values())))
        for part in self._parts(time_ns):
            rows = rr.StateChange.columns(state=shown[part].tolist())
            self.stream.send_columns(path, self.indexes(time_ns[part]), rows)
        self.stream.send_columns(path, self._behind_all(), rr.StateChange.columns(state=[""]))

    def _behind_all(self) -> list[rr.TimeColumn]:
        """Return time columns of the place behind the last flight.

        A state that begins there is never seen.
        """
        columns = [rr.TimeColumn(FLIGHT_NUMBER, sequence=[len(self.order) + 1])]
        if self.timed:
            known = self.starts[: self.timed]
            margin = max(np.timedelta64(1, "D"), (known[-1] - known[0]) / self.timed)
            columns.append(rr.TimeColumn(UTC, timestamp=[known[-1] + margin]))
        return columns

    def _parts(self, time_ns: Int64Array) -> list[Int64Array]:
        """Return rows of flights with a time, and of those without."""
        has_time = time_ns <= self.timed
        return [rows for rows in (np.flatnonzero(has_time), np.flatnonzero(~has_time)) if len(rows)]
