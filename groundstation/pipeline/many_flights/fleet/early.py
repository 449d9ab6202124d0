"""Shares of flights in the fleet, read as each flight ends.

The process that leads a run waits while others compute: reading then costs a user no time. Read at the end, the shares
of 64 flights took as long as two flights.
"""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from groundstation.pipeline.many_flights.fleet.columns import FlightShare
from groundstation.pipeline.many_flights.fleet.rows import share_of
from groundstation.pipeline.many_flights.fleet.samples import SampleStore
from groundstation.pipeline.many_flights.fleet.scan import stamp_of

MOST = 1000  # logs of a run whose shares wait for its end; of more, all workers read them then


class EarlyShares:
    """What flights add to the fleet, by flight id, with the stamp that each folder had.

    Parameters
    ----------
    out : Path
        Holds the flight folders, and the samples that are put there with each share.
    """

    def __init__(self, out: Path) -> None:
        self._out, self._samples = out, SampleStore(out)
        self._found: dict[str, tuple[int, FlightShare]] = {}

    def read(self, flight_ids: Iterable[str]) -> None:
        """Read the shares of flights that are in place.

        One that cannot be read is left out: whoever puts the fleet together reads it again, and tells why.
        """
        for name in flight_ids:
            stamp = stamp_of(self._out, name)
            with suppress(Exception):
                if stamp is not None:
                    self._found[name] = stamp, share_of(self._out / name, self._samples)

    def of(self, name: str, stamp: int | None) -> FlightShare | None:
        """Share of a flight whose folder has this stamp; None where none was read with it."""
        found = self._found.get(name)
        return found[1] if found is not None and found[0] == stamp else None

    def unread(self, flight_ids: Iterable[str]) -> list[str]:
        """Return those of the flights that have not been read."""
        return [name for name in flight_ids if name not in self._found]
