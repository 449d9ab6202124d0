"""Epochs of a GNSS receiver, each once."""

import numpy as np

from groundstation.tables.table import Table

MOVING_MPS = 1.0


def distinct_epochs(table: Table) -> Table:
    """Return the GNSS rows with a velocity, each receiver epoch once.

    Rows of one time are one epoch. A recorder that runs faster than the receiver writes each epoch several times:
    a row that repeats the velocity (and position) before it is dropped while moving; and everywhere where more than
    a fifth of the moving rows are such repetitions. A receiver that holds its velocity at standstill is left alone.
    """
    table = table.take(table.valid("velocity_north_mps", "velocity_east_mps")).unique_times()
    if len(table) < 2:
        return table
    fields = [
        name for name in ("velocity_north_mps", "velocity_east_mps", "latitude_deg", "longitude_deg") if table.has(name)
    ]
    repeated = np.zeros(len(table), dtype=bool)
    repeated[1:] = np.all([np.diff(table.values(name)) == 0.0 for name in fields], axis=0)
    moving = np.hypot(table.values("velocity_north_mps"), table.values("velocity_east_mps")) > MOVING_MPS
    is_recorder_faster = moving.any() and float(np.mean(repeated[moving])) > 0.2
    return table.take(~(repeated & (moving | is_recorder_faster)))
