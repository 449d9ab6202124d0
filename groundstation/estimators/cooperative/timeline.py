"""The order in which a filter works: measurements, alone or a frame together, and times of output between them."""

from collections.abc import Iterator

from groundstation.estimators.cooperative.events import Event, Prepared
from groundstation.estimators.cooperative.settings import CooperativeSettings

Group = tuple[float, tuple[Event, ...]]
Output = tuple[float, int]


def groups_of(events: tuple[Event, ...], *, together: bool, frame_s: float) -> list[Group]:
    """Measurements that are used in one update, with the time at which it is made: that of the last of them."""
    if not together:
        return [(event.time_s, (event,)) for event in events]
    groups: list[Group] = []
    frame: list[Event] = []
    number = None
    for event in events:
        here = int((event.time_s + 1e-9) // frame_s)
        if frame and here != number:
            groups.append((frame[-1].time_s, tuple(frame)))
            frame = []
        frame.append(event)
        number = here
    if frame:
        groups.append((frame[-1].time_s, tuple(frame)))
    return groups


def timeline(prepared: Prepared, settings: CooperativeSettings, *, together: bool) -> Iterator[Group | Output]:
    """Groups and outputs in order of time; an output sees every group that is not later."""
    outputs = prepared.output_times_s(settings.output_step_s)
    next_output = 0
    for group in groups_of(prepared.events, together=together, frame_s=settings.frame_s):
        while next_output < len(outputs) and outputs[next_output][0] < group[0] - 1e-9:
            yield outputs[next_output]
            next_output += 1
        yield group
    yield from outputs[next_output:]
