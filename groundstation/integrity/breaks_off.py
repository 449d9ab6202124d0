"""Topics that end before the others: records that their rate promises and no log holds."""

import numpy as np

from groundstation.base.gaps import logged_ns
from groundstation.base.records import Damage
from groundstation.base.signals import is_canonical, kind_of
from groundstation.base.units import NS_PER_S
from groundstation.integrity.ledger import LedgerCounts

BREAKS_OFF = "breaks_off"
ONCE_SHARE = 0.05  # of the log: a raw topic that spans less was written once (files, definitions), and has ended
COME_AND_GO = ("link", "satellite")  # kinds of topics about others, who get out of reach: no loss


def broken_off(ledger: LedgerCounts) -> tuple[Damage, ...]:
    """Return damage for topics with a rate that stop while others go on.

    Returns
    -------
    tuple of Damage
        One a topic, with the records missing by its rate. Only canonical topics lose data, as nothing is estimated from
        raw ones, and of those none of a kind that comes and goes. Raw topics that were written once end with that.
    """
    limits, end_ns = ledger.thresholds.gaps, ledger.end_ns
    allowed_s = max(limits.end_s, limits.end_share * (end_ns - ledger.start_ns) / NS_PER_S)
    found = []
    for topic in ledger.topics:
        missing_s = (end_ns - topic.last_ns) / NS_PER_S
        if topic.nominal_rate_hz is None or missing_s <= allowed_s:
            continue
        if not is_canonical(topic.topic) and topic.last_ns - topic.first_ns < ONCE_SHARE * (end_ns - ledger.start_ns):
            continue
        ends_ns = logged_ns(np.array([topic.last_ns, end_ns]), ledger.pauses)
        rows = round(int(ends_ns[1] - ends_ns[0]) / NS_PER_S * topic.nominal_rate_hz)
        what = f"{topic.topic} ends {missing_s:.1f} s before the log does, records missing at its rate"
        place = f"after {ledger.clock.text(topic.last_ns)}"
        is_loss = is_canonical(topic.topic) and kind_of(topic.topic) not in COME_AND_GO
        found.append(Damage(BREAKS_OFF, place, rows, what, topic.topic, is_loss))
    return tuple(found)
