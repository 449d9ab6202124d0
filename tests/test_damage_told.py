"""Findings on answers that rest on damage: spans of no length, and one span more than is shown."""

import numpy as np

from groundstation.base.gaps import Gaps
from groundstation.base.ledger import DamagedSpan, Ledger
from groundstation.base.records import Column
from groundstation.pipeline.one_flight.damage import SHOWN, damage_finding
from groundstation.systems.analysis import RestsOn
from groundstation.tables.table import Flight, Table


def span(start_s: float, length_s: float = 0.0, *, is_exact: bool = False) -> DamagedSpan:
    return DamagedSpan(
        cause="sequence",
        count=1,
        field="",
        is_exact=is_exact,
        length_s=length_s,
        start="",
        start_s=start_s,
        topic="",
    )


def told(*spans: DamagedSpan) -> str:
    time_ns = np.arange(3)
    flight = Flight({"ins": Table("ins", time_ns, {}, np.arange(3), Column(time_ns))})
    use = RestsOn(("ins",), ("roll_deg",), ((0.0, 100.0),))
    found = damage_finding(
        "a.damage",
        "one",
        use,
        Ledger(spans=spans),
        flight,
        {"ins": Gaps("ins", np.zeros(0, dtype=np.int64), np.zeros(0))},
    )
    assert found is not None
    return found.text


def test_a_span_of_no_length_is_a_moment() -> None:
    assert told(span(14.2)) == "one: uses samples in or around sequence (somewhere at +0:14.2)"
    assert told(span(14.2, 0.5, is_exact=True)).endswith("sequence (from +0:14.2 for 0.5 s)")


def test_one_span_more_is_one() -> None:
    assert told(*(span(10.0 * one) for one in range(SHOWN + 1))).endswith("; 1 more damaged span")
    assert told(*(span(10.0 * one) for one in range(SHOWN + 2))).endswith("; 2 more damaged spans")
