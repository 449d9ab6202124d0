"""Alignments that the logged mode of an INS shows, without the flicker of its flag."""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.systems.inertial.differences import UNUSED_MODES
from groundstation.tables.motion import runs
from groundstation.tables.table import Flight

ALIGN = "align"
LEAST_ALIGNMENT_S = 5.0  # a mode that lasts for less is a flicker of the flag


@dataclass(frozen=True)
class ModeSpans:
    """Alignments by the logged mode: spans of flight seconds.

    ``flicker`` counts those too short to be one. ``ended_s`` are the moments at which one of them gives way to
    navigation. ``is_logged``: the log has modes. ``first_s``: time of the first.
    """

    spans_s: tuple[tuple[float, float], ...]
    ended_s: tuple[float, ...]
    flicker: int
    is_logged: bool
    first_s: float


def mode_spans(flight: Flight, topic: str) -> ModeSpans:
    """Return the alignments that the mode of an INS shows.

    Navigation for less than five seconds between two of them is a flicker of the flag, and so is so short an alignment.
    """
    table = flight[topic].unique_times()
    mode = table.text("mode")
    known = mode != ""
    time_s, mode = flight.seconds(table.time_ns[known]), mode[known]
    if not len(time_s):
        return ModeSpans((), (), 0, is_logged=False, first_s=0.0)
    usual_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0
    spans = [
        (float(time_s[first]), float(time_s[end]) if end < len(time_s) else float(time_s[-1]) + usual_s)
        for first, end in runs(mode == ALIGN)
    ]
    joined: list[tuple[float, float]] = []
    flicker = 0
    for start_s, end_s in spans:
        if joined and start_s - joined[-1][1] < LEAST_ALIGNMENT_S:
            joined[-1] = (joined[-1][0], end_s)
            flicker += 1
        else:
            joined.append((start_s, end_s))
    lasting = tuple(one for one in joined if one[1] - one[0] >= LEAST_ALIGNMENT_S)
    flicker += len(joined) - len(lasting)
    navigates = time_s[~np.isin(mode, UNUSED_MODES)]
    ended = tuple(end_s for _, end_s in lasting if np.isin(end_s, navigates))
    return ModeSpans(lasting, ended, flicker, is_logged=True, first_s=float(time_s[0]))
