"""Plot of data quality: where data are present and where they are missing, by topic."""

import numpy as np

from groundstation.base.ledger import PauseEntry
from groundstation.chapters.wording import number
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import Lanes
from groundstation.plots.plot import Panel, Plot, one_panel
from groundstation.plots.ranges import finite, padded
from groundstation.results.arrays.flight import GapRows, LedgerRows
from groundstation.results.arrays.typed import Floats, Texts
from groundstation.results.flight import FlightResults

MOST_LANES, MOST_GAPS = 24, 500  # gaps of one topic
LANE_MM = 4.6


def gaps(results: FlightResults) -> Plot | None:
    """Return strips of data and gaps over flight time; None without a ledger."""
    ledger, holes = results.rows_of(LedgerRows), results.rows_of(GapRows)
    if ledger is None:
        return None
    topic, first, last = ledger.topic, ledger.first_s, ledger.last_s
    gap_topic = np.zeros(0, dtype=np.str_) if holes is None else holes.topic
    chosen = sorted(range(len(topic)), key=lambda row: (topic[row] not in gap_topic, row))[:MOST_LANES]
    chosen.sort()
    times = finite(first, last)
    if not times.size:
        return None
    low, high = padded(float(times.min()), float(times.max()), 0.01, 0.5)
    least = (high - low) / 400.0  # narrower marks would not be seen
    order = tuple(topic[chosen].tolist())
    end = np.maximum(last[chosen], first[chosen] + least)
    pauses = results.ledger.pauses
    start, end, state = _without_pauses(first[chosen], end, topic[chosen], pauses)
    marks = [Lanes(start=start, end=end, state=state, order=order, role="ins", emphasis="faint")]
    if holes is not None:
        marks.append(_gaps(holes, order, least))
    count = 0 if holes is None else len(holes)
    caption = f"Blue: data; red: gaps, n = {number(count, 0)}{', widened to be seen' if count else ''}."
    uneven = int(np.count_nonzero(np.isnan(ledger.nominal_rate_hz[chosen]) & (ledger.gaps[chosen] == 0)))
    paused_s = sum(one.length_s for one in pauses)
    caption += f" Nothing was logged for {number(paused_s, 0)} s while disarmed: left white." if pauses else ""
    caption += f" Sent irregularly, so that no gap can be told: {uneven} of these topics." if uneven else ""
    caption += f" {len(order)} of {len(topic)} topics." if len(order) < len(topic) else ""
    return Plot(
        "quality.gaps",
        "Gaps",
        caption,
        "Strips of data and gaps by topic over flight time.",
        one_panel(Panel(marks, time_axis(low, high), legend=""), 2.0 + LANE_MM * len(order)),
        ("ledger",) if holes is None else ("ledger", "gaps"),
    )


def _without_pauses(
    start: Floats, end: Floats, state: Texts, pauses: tuple[PauseEntry, ...]
) -> tuple[Floats, Floats, Texts]:
    """Return spans with the pauses of the log cut out."""
    for one in pauses:
        from_s, to_s = one.start_s, one.start_s + one.length_s
        before, behind = start < from_s, end > to_s
        start, end, state = (
            np.concatenate((start[before], np.maximum(start[behind], to_s))),
            np.concatenate((np.minimum(end[before], from_s), end[behind])),
            np.concatenate((state[before], state[behind])),
        )
    return start, end, state


def _gaps(holes: GapRows, order: tuple[str, ...], least_s: float) -> Lanes:
    """Return the longest gaps of each topic, each wide enough to be seen."""
    rows = [np.flatnonzero(holes.topic == name) for name in order]
    kept = [mine[np.sort(np.argsort(-holes.length_s[mine], kind="stable")[:MOST_GAPS])] for mine in rows]
    shown = np.concatenate(kept) if kept else np.zeros(0, dtype=np.intp)
    start = holes.start_s[shown]
    end = start + np.maximum(holes.length_s[shown], least_s)
    return Lanes(start=start, end=end, state=holes.topic[shown], order=order, role="bad")
