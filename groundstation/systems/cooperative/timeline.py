"""Order in which a filter works: measurements, single or by frame, and output times."""

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import Items
from groundstation.systems.cooperative.settings import CooperativeSettings

SAME_TIME_S = 1e-9


def timeline(prepared: Prepared, settings: CooperativeSettings, *, together: bool) -> Items:
    """Return groups of measurements and outputs in order of time.

    An output sees every group that is not later. Measurements that are used together make their update at the time of
    the last of them.
    """
    time_s = prepared.events.time_s
    first = np.arange(len(time_s))
    if together:
        frame = np.floor((time_s + SAME_TIME_S) / settings.frame_s)
        first = np.flatnonzero(np.diff(frame, prepend=-np.inf))
    last = np.append(first[1:], len(time_s))[: len(first)]
    group_s = time_s[last - 1]
    output_s, vehicle = _outputs(prepared, settings.output_step_s)
    after = np.searchsorted(group_s - SAME_TIME_S, output_s, side="right")  # groups that each output sees
    # an output stands behind every group at least as early, within rounding
    order = np.lexsort((np.concatenate([np.zeros(len(first)), np.ones(len(output_s))]), _places(len(first), after)))
    none = np.zeros(len(output_s), dtype=np.int64)
    return Items(
        np.concatenate([group_s, output_s])[order],
        np.concatenate([np.full(len(first), -1, dtype=np.int64), vehicle])[order],
        np.concatenate([first, none]).astype(np.int64)[order],
        np.concatenate([last, none]).astype(np.int64)[order],
    )


def _places(groups: int, after: Int64Array) -> Int64Array:
    """Return sort keys: group g has g + 1, an output that sees g groups has g.

    The output follows by the second key.
    """
    return np.concatenate([np.arange(1, groups + 1), after])


def _outputs(prepared: Prepared, step_s: float) -> tuple[np.ndarray, Int64Array]:
    """Times of output with the vehicle each belongs to, in order of time."""
    numbers = [
        np.arange(np.ceil(one.first_s / step_s - 1e-9), np.floor(one.last_s / step_s + 1e-9) + 1.0)
        for one in prepared.vehicles
    ]
    vehicle = np.repeat(np.arange(len(numbers)), [len(part) for part in numbers])
    time_s = np.concatenate(numbers) * step_s
    order = np.lexsort((vehicle, time_s))
    return time_s[order], vehicle[order]
