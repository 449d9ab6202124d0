"""Table of a folder of flights as a pandas frame that also opens the flights."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from groundstation.base.errors import UnknownNameError, UsageError, told_in_a_line
from groundstation.base.unit_names import units_of
from groundstation.pipeline.opened import SavedRun


class Fleet(pd.DataFrame):
    """Table of flights, one row each, that opens them by their ids.

    ``fleet.flight(flight_id)`` opens one; the column of flight numbers is ``fleet["flight"]``. It is a DataFrame in all
    else: what is selected, sorted or grouped of it has the same type and still opens flights;
    a column is a plain Series. ``attrs["units"]`` has the units of its columns.
    """

    _metadata = ["folder"]  # noqa: RUF012 -- pandas reads a list
    folder: Path | None = None

    @property
    def _constructor(self) -> "Callable[..., Fleet]":
        return Fleet

    def __finalize__(self, other: Any, method: str | None = None, **options: Any) -> "Fleet":
        """Keep the folder of the frame, or of several that are joined, it was made of."""
        made: Fleet = super().__finalize__(other, method, **options)  # type: ignore[misc]  # pandas' stubs lack it
        joined = getattr(other, "input_objs", None) or getattr(other, "objs", None) or ()
        folders = {one.folder for one in joined if isinstance(one, Fleet)}
        if len(folders) == 1:
            made.folder = folders.pop()
        return made

    def flight(self, flight_id: str) -> SavedRun:
        """Open a flight of the table; arrays and tables are read when they are asked for.

        Parameters
        ----------
        flight_id : str
            A value of the column ``flight_id``, or of the index of that name.

        Raises
        ------
        UnknownNameError
            When the table has no such flight; the message lists similar ids.
        GroundstationError
            When its folder is gone or cannot be read.
        """
        is_index = self.index.name == "flight_id"
        if self.folder is None or not (is_index or "flight_id" in self):
            raise UsageError("the table of flights", "no column flight_id, or no folder", "the frame of open_fleet()")
        known = [str(one) for one in (self.index if is_index else self["flight_id"])]
        if flight_id not in known:
            raise UnknownNameError(f"fleet {self.folder}", str(flight_id), known)
        with told_in_a_line(flight_id):
            return SavedRun(self.folder / flight_id)


def fleet_of(frame: pd.DataFrame, folder: Path) -> Fleet:
    """Return a table of flights that opens them from their folder."""
    fleet = Fleet(frame)
    fleet.folder = folder
    fleet.attrs["units"] = units_of(frame.columns)
    return fleet
