"""Parity of units: which of three or more the differences of pairs point at."""

from collections.abc import Mapping, Sequence

import numpy as np

CLEARLY_MORE = 2.0  # times as far over its limits as the others' pairs, for parity to name a unit

Overs = Mapping[tuple[str, ...], float]


def by_parity(topics: Sequence[str], overs: Overs) -> tuple[str, ...]:
    """Return the unit that three or more differ over, or those between which they do not tell.

    Parameters
    ----------
    topics : sequence of str
        Units that may be it.
    overs : mapping
        Of each judged pair, how many times its limit its difference is.

    Notes
    -----
    The unit named is in every pair beyond its limit; its nearest pair must be twice as far over its limit as the
    farthest pair without it, so that the direction of the parity vector is clear.

    Examples
    --------
    >>> by_parity("abc", {("a", "b"): 3.0, ("b", "c"): 2.5, ("a", "c"): 0.3})
    ('b',)
    >>> by_parity("abc", {("a", "b"): 1.1, ("b", "c"): 0.6, ("a", "c"): 0.9})
    ('a', 'b')
    """
    judged = {pair: over for pair, over in overs.items() if set(pair) <= set(topics)}
    beyond = [pair for pair, over in judged.items() if over > 1.0]
    candidates = [topic for topic in topics if all(topic in pair for pair in beyond)]
    if len(candidates) == 1 and _is_clear(candidates[0], judged, 1.0):
        return (candidates[0],)
    clear = [topic for topic in topics if _is_clear(topic, judged, CLEARLY_MORE)]
    if len(clear) == 1:
        return (clear[0],)
    return tuple(candidates) or tuple(topics)


def in_words(units: int) -> str:
    """Return by what so many units show a difference."""
    if units == 2:
        return "in the difference of two units"
    return f"by parity of {'three' if units == 3 else units} units"


def _is_clear(topic: str, overs: Overs, times: float) -> bool:
    own = [over for pair, over in overs.items() if topic in pair]
    others = [over for pair, over in overs.items() if topic not in pair]
    return bool(own) and bool(others) and float(np.median(own)) > times * max(others)
