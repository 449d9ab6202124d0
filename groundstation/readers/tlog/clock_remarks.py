"""Remarks on the clocks of a telemetry log, and on the delay of its link."""

from collections.abc import Iterator

from groundstation.base.records import Remark
from groundstation.base.units import NS_PER_S
from groundstation.readers.tlog.clock import TlogClocks
from groundstation.readers.tlog.dialect import messages
from groundstation.readers.tlog.timer import Timer


def clock_remarks(clocks: TlogClocks, vehicle: int, timer: Timer) -> Iterator[Remark]:
    """Yield remarks on the clocks and the delay; ``timer`` has placed all frames."""
    for text in _of_clocks(clocks, vehicle):
        yield Remark("clock_used", text)
    yield Remark("link_delay", _of_link(clocks, vehicle, timer))


def _of_clocks(clocks: TlogClocks, vehicle: int) -> Iterator[str]:
    for record, size_ns in clocks.offsets.steps():
        yield f"the ground station's clock was set by {size_ns / NS_PER_S:+.3f} s before frame {record}"
    if clocks.ground_ns:
        off_s = -clocks.ground_ns / NS_PER_S
        yield f"UTC is that of the vehicle's messages: the ground station's clock is {off_s:+.3f} s off"
    clock = clocks.senders.get(vehicle)
    if clock is not None and len(clock.epochs) > 1:
        starts = ", ".join(str(epoch.first) for epoch in clock.epochs[1:])
        yield f"the vehicle's clock started again: before frame {starts}"


def _of_link(clocks: TlogClocks, vehicle: int, timer: Timer) -> str:
    """Return how late frames arrived, and what the first reading of the clock is made of."""
    clock = clocks.senders.get(vehicle)
    if clock is None:
        return "times are those of receipt on the ground, by the ground station's clock; the link's delay is in them"
    first = ""
    if timer.first_received_ns is not None and timer.earliest_ns is not None:
        late_ns = timer.first_received_ns - timer.earliest_ns
        first = f", the first {late_ns / NS_PER_S:.3f} s after the earliest value is valid"
        if clocks.ground_ns:
            off_s, sum_s = -clocks.ground_ns / NS_PER_S, (late_ns - clocks.ground_ns) / NS_PER_S
            first += f" (with {off_s:+.3f} s of the clock its reading is {sum_s:+.3f} s from that value)"
    return (
        f"frames arrived up to {timer.most_late_ns / NS_PER_S:.2f} s late{first}; values are valid by the vehicle's "
        f"clock ({messages()[clock.reference].name}), set by the frames that arrived soonest; device times are those "
        "of receipt on the ground"
    )
