"""Arrays of logs joined into one flight; their columns are named after the topics."""

from groundstation.results.arrays.typed import Arrays, ByName, Floats, family


class JoinedMotion(Arrays, figure="together_{}_motion", digits={"*": 3}):
    """The motion of a joined log over that of the log with the flight's clock."""

    time_s: Floats
    motion: ByName = family("{}")


class JoinedDifference(Arrays, figure="together_{}_difference", digits={"*": 3}):
    """The difference of the two motions."""

    time_s: Floats
    difference: ByName = family("{}")
