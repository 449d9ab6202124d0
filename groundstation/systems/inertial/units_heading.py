"""Headings of units that differ by more than honest units do."""

from collections.abc import Sequence

from groundstation.systems.inertial.units_answer import InsFault
from groundstation.systems.inertial.units_compare import Judged
from groundstation.systems.inertial.units_parity import by_parity, in_words


def heading_faults(pairs: Sequence[Judged]) -> list[InsFault]:
    """Return the fault of a heading that stands apart; of two units it may be either.

    A heading that is off leaves position and velocity as they are: it is judged in pairs, by itself. GNSS has no
    heading to name the unit by.
    """
    judged = {pair.topics: pair for pair in pairs if pair.heading_over is not None}
    overs = {topics: pair.heading_over or 0.0 for topics, pair in judged.items()}
    beyond = [topics for topics, over in overs.items() if over > 1.0]
    if not beyond:
        return []
    units = list(dict.fromkeys(topic for topics in overs for topic in topics))
    who = by_parity(units, overs) if len(units) > 2 else beyond[0]
    worst = judged[max((topics for topics in beyond if set(topics) & set(who)), key=lambda topics: overs[topics])]
    heading, limits = worst.heading, worst.limits
    assert heading is not None
    assert limits is not None
    size, half, limit = heading.value, heading.half95, limits.heading_deg
    if len(who) == 1:  # a pair is its second unit less the first
        signed = size if worst.topics[1] == who[0] else -size
        text = f"heading {signed:+.2f} deg from the others (limit {limit:.2f})"
        return [InsFault("heading", who, in_words(len(units)), text, None, None, signed, half, "deg", limit)]
    text = f"headings {abs(size):.2f} deg apart (limit {limit:.2f})"
    return [InsFault("heading", who, in_words(len(units)), text, None, None, abs(size), half, "deg", limit)]
