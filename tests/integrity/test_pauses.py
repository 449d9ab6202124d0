"""Silences of a whole log: pauses while disarmed, stops that nothing explains, losses of one topic beside them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.gaps import Pause, logged_ns
from groundstation.base.ledger import Ledger
from groundstation.base.records import Column, Int64Array, Item, LogHeader, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.integrity.ledger import LedgerCounts, gaps_of
from groundstation.integrity.ledger_findings import ledger_findings
from groundstation.integrity.ordering import corrected
from groundstation.integrity.pauses import says_no_log_while_disarmed
from groundstation.integrity.survey import Census, survey
from groundstation.pipeline.one_flight.log import open_log
from tests.readers.dataflash_writer import flight_log

RATES_HZ = {"ins": 50.0, "gnss": 5.0, "baro": 10.0, "raw.ATT": 50.0, "raw.SLOW": 0.2}
DISARMED, ARMED = (40.0, "disarmed"), (70.0, "armed")
TOLD = ("data.not_logged", "data.silent", "data.gaps")


def batch_of(topic: str, time_s: Sequence[float], index: Int64Array, **columns: Column) -> RecordBatch:
    time_ns = np.round(np.array(time_s) * NS_PER_S).astype(np.int64)
    return RecordBatch(topic, index, Column(time_ns), dict(columns))


def log_of(
    events: Sequence[tuple[float, str]],
    holes: Sequence[tuple[float, float]] = ((40.1, 70.1),),
    own: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    length_s: float = 100.0,
    alive: Mapping[str, Sequence[float]] | None = None,
) -> list[Item]:
    """Make a log of topics at fixed rates, in order of time.

    ``holes`` are times without a record of any of them, ``own`` those of one; events and ``alive`` are always there.
    """
    times = {topic: np.arange(0.0, length_s, 1.0 / rate) for topic, rate in RATES_HZ.items()}
    for topic in times:
        for start, end in (*holes, *(own or {}).get(topic, ())):
            times[topic] = times[topic][(times[topic] < start) | (times[topic] >= end)]
    times |= {topic: np.array(some) for topic, some in (alive or {}).items()}
    times["event"] = np.array([time_s for time_s, _name in events])
    place = np.argsort(np.argsort(np.concatenate(list(times.values())), kind="stable")).astype(np.int64)
    items: list[Item] = [LogHeader("t")]
    at = 0
    for topic, some in times.items():
        names = {"name": Column(np.array([name for _time, name in events]))} if topic == "event" and events else {}
        if len(some):
            items.append(batch_of(topic, some.tolist(), place[at : at + len(some)], **names))
        at += len(some)
    return items


def found_in(items: list[Item]) -> LedgerCounts:
    return survey(items).ledger


def told(ledger: LedgerCounts) -> list[tuple[str, str, str]]:
    return [(one.code, one.severity, one.topic) for one in ledger_findings(ledger) if one.code in TOLD]


def seconds(pauses: Sequence[Pause]) -> list[tuple[float, float]]:
    return [(round(one.start_ns / NS_PER_S, 3), round(one.end_ns / NS_PER_S, 3)) for one in pauses]


def test_a_pause_while_disarmed_is_told_once_and_is_no_gap() -> None:
    ledger = found_in(log_of([(1.0, "armed, mode LOITER"), DISARMED, (40.1, "mode STABILIZE"), ARMED]))
    assert seconds(ledger.pauses) == [(40.08, 70.0)] and ledger.stops == ()  # 70.0 s: when it was armed
    assert told(ledger) == [("data.not_logged", "info", "")] and not ledger.loses_data
    (finding,) = (one for one in ledger_findings(ledger) if one.code == "data.not_logged")
    assert "29.9 s" in finding.text and finding.place.startswith("from ") and finding.place in finding.text
    for topic in ("ins", "gnss", "baro", "raw.ATT"):
        assert ledger[topic].coverage == pytest.approx(1.0, abs=0.01) and not len(ledger[topic].gaps)
        assert ledger[topic].actual_rate_hz == pytest.approx(RATES_HZ[topic], rel=0.01)


def test_the_same_silence_without_events_is_one_warning() -> None:
    ledger = found_in(log_of([]))
    assert ledger.pauses == () and seconds(ledger.stops) == [(40.08, 70.1)]
    assert told(ledger) == [("data.silent", "warn", "")]
    assert ledger["ins"].coverage == pytest.approx(0.7, abs=0.01)  # the data are missing all the same
    assert len(ledger["ins"].gaps) == len(ledger["gnss"].gaps) == 1


def test_gaps_of_a_topic_are_counted_once_and_stops_of_the_log_are_named() -> None:
    ledger = found_in(log_of([], own={"gnss": [(20.0, 25.0)]}))
    (finding,) = (one for one in ledger_findings(ledger) if one.code == "data.gaps")
    entry = ledger.document().topics["gnss"].gaps
    assert finding.count == entry.count == len(ledger["gnss"].gaps) == 2
    assert finding.text.startswith(f"gnss: 2 gaps, {entry.total_s:.1f} s together, the longest 30.2 s after ")
    assert finding.text.endswith("; 1 of them stops of the whole log")


@pytest.mark.parametrize(
    ("own", "gap"),
    [
        ((35.0, 50.0), (34.8, 40.08)),  # it stopped before the disarm
        ((60.0, 76.0), (70.0, 76.0)),  # it came back long after the arm
        ((20.0, 25.0), (19.8, 25.0)),  # it has nothing to do with the pause
    ],
)
def test_a_loss_of_one_topic_beside_a_pause_stays_its_own(own: tuple[float, float], gap: tuple[float, float]) -> None:
    ledger = found_in(log_of([DISARMED, ARMED], own={"gnss": [own]}))
    assert seconds(ledger.pauses) == [(40.08, 70.0)]
    assert told(ledger) == [("data.not_logged", "info", ""), ("data.gaps", "warn", "gnss")]
    gaps = ledger["gnss"].gaps
    ends_ns = gaps.start_ns + np.round(gaps.length_s * NS_PER_S).astype(np.int64)
    assert seconds([Pause(int(a), int(b)) for a, b in zip(gaps.start_ns, ends_ns, strict=True)]) == [gap]


@pytest.mark.parametrize(
    "events",
    [
        [ARMED],  # nothing says that it was disarmed
        [(75.0, "disarmed"), (80.0, "armed")],
        [DISARMED],  # recording goes on, and nothing says why
        [DISARMED, (60.0, "armed")],  # it was armed within the silence
        [DISARMED, (90.0, "armed")],  # recording went on long before the arm
        [(40.0, "armed"), (70.0, "disarmed")],
        [(40.0, "throttle disarmed"), (70.0, "auto armed")],  # other events
    ],
)
def test_a_silence_that_arming_does_not_explain_stays_a_warning(events: list[tuple[float, str]]) -> None:
    ledger = found_in(log_of(events))
    assert ledger.pauses == () and told(ledger) == [("data.silent", "warn", "")]


def with_setting(items: list[Item], value: float) -> list[Item]:
    """Add the parameter that says whether the autopilot logs while disarmed."""
    index = np.array([sum(len(one) for one in items if isinstance(one, RecordBatch))], dtype=np.int64)
    columns = {"Name": Column(np.array(["LOG_DISARMED"])), "Value": Column(np.array([value]))}
    return [*items, batch_of("raw.PARM", [99.9], index, **columns)]


@pytest.mark.parametrize(
    ("events", "value", "pauses"),
    [
        ([DISARMED], 0.0, [(40.08, 70.1)]),  # it resumed as an arming failed, and was never armed again
        ([DISARMED, (90.0, "armed")], 0.0, [(40.08, 70.1)]),  # the second try succeeded
        ([DISARMED], 1.0, []),  # it logs while disarmed: something stopped it
        ([], 0.0, []),  # nothing says that it was disarmed
        ([(75.0, "disarmed")], 0.0, []),  # it was disarmed later
        ([DISARMED, (60.0, "armed")], 0.0, []),  # armed within the silence
    ],
)
def test_a_silence_while_disarmed_is_a_pause_where_the_setting_says_so(
    events: list[tuple[float, str]], value: float, pauses: list[tuple[float, float]]
) -> None:
    """A log that resumed after a failed arming was told as silent without a reason."""
    ledger = found_in(with_setting(log_of(events), value))
    assert seconds(ledger.pauses) == pauses
    assert told(ledger) == [("data.not_logged", "info", "") if pauses else ("data.silent", "warn", "")]


def test_a_log_that_stops_before_the_disarm_has_a_stop_and_a_pause() -> None:
    ledger = found_in(log_of([DISARMED, ARMED], holes=[(30.0, 70.1)]))
    assert seconds(ledger.pauses) == [(40.0, 70.0)] and seconds(ledger.stops) == [(29.98, 40.0)]
    assert told(ledger) == [("data.not_logged", "info", ""), ("data.silent", "warn", "")]


def test_an_autopilot_that_logs_for_a_while_after_the_disarm_still_pauses() -> None:
    ledger = found_in(log_of([DISARMED, (85.0, "armed")], holes=[(55.0, 85.05)]))
    assert seconds(ledger.pauses) == [(54.98, 85.0)] and told(ledger) == [("data.not_logged", "info", "")]


def test_disarmed_without_a_pause_hides_no_loss() -> None:
    ledger = found_in(log_of([DISARMED, ARMED], holes=[], own={"ins": [(45.0, 70.1)], "raw.ATT": [(45.0, 70.1)]}))
    assert ledger.pauses == () and ledger.stops == ()
    assert ("data.gaps", "warn", "ins") in told(ledger)


def test_a_topic_that_goes_on_refutes_a_pause() -> None:
    ledger = found_in(log_of([DISARMED, ARMED], alive={"raw.PM": np.arange(0.05, 100.0, 1.0).tolist()}))
    assert ledger.pauses == () and ledger.stops == ()
    assert {topic for _code, _severity, topic in told(ledger)} >= {"ins", "gnss", "baro"}


def test_several_pauses_are_one_finding() -> None:
    events = [(20.0, "disarmed"), (30.0, "armed"), (50.0, "disarmed"), (80.0, "armed")]
    ledger = found_in(log_of(events, holes=[(20.1, 30.1), (50.1, 80.1)]))
    assert seconds(ledger.pauses) == [(20.08, 30.0), (50.08, 80.0)]
    (finding,) = (one for one in ledger_findings(ledger) if one.code in TOLD)
    assert "2 times: 39.8 s together, the longest 29.9 s" in finding.text and finding.count == 2


def test_a_single_topic_keeps_its_gap() -> None:
    time_s = [*np.arange(0.0, 40.0, 0.1), *np.arange(70.0, 100.0, 0.1)]
    ledger = found_in([LogHeader("t"), batch_of("gnss", time_s, np.arange(len(time_s)))])
    assert told(ledger) == [("data.gaps", "warn", "gnss")]


def test_a_clock_that_leaps_while_disarmed_is_no_pause() -> None:
    """Records go on after the disarm and 600 s are skipped: the leap does not end with the arm."""
    items = log_of([DISARMED, (700.0, "armed")], holes=[(50.0, 650.0)], length_s=800.0)
    ledger = found_in(items)
    assert ledger.pauses == () and told(ledger) == [("data.silent", "warn", "")]


def test_the_census_of_a_stored_log_finds_the_same_and_the_ledger_keeps_it() -> None:
    items = log_of([DISARMED, ARMED], own={"gnss": [(60.0, 76.0)]})
    found = survey(items)
    census = Census(found.clock.is_absolute)
    for batch in corrected(items, found.clock):
        census.add(batch)
    counted = census.ledger()
    assert counted.pauses == found.ledger.pauses and told(counted) == told(found.ledger)
    document = found.ledger.document()
    (pause,) = document.pauses
    assert (pause.start_s, pause.length_s) == (40.08, 29.92)
    assert counted.document().topics["gnss"].gaps == document.topics["gnss"].gaps
    assert json.loads(json.dumps(asdict(document)))["pauses"] and Ledger().pauses == ()


def test_logged_time_stands_still_in_pauses() -> None:
    pauses = (Pause(10, 20), Pause(30, 50))
    assert logged_ns(np.array([0, 10, 15, 20, 29, 30, 49, 60]), pauses).tolist() == [0, 10, 10, 10, 19, 20, 20, 30]
    time_ns = np.array([0, 1, 2, 9, 10, 11]) * NS_PER_S
    assert len(gaps_of("ins", time_ns)) == 1
    assert not len(gaps_of("ins", time_ns, pauses=(Pause(2 * NS_PER_S, 9 * NS_PER_S),)))


@pytest.mark.parametrize("has_events", [True, False])
def test_an_ardupilot_log_that_pauses_while_disarmed(tmp_path: Path, has_events: bool) -> None:
    path = tmp_path / "a.BIN"
    path.write_bytes(b"".join(flight_log(60, range(20, 40), has_events=has_events).records))
    ledger = survey(open_log(path).items()).ledger
    (silence,) = ledger.pauses if has_events else ledger.stops
    assert silence.length_s == pytest.approx(20.0, abs=0.1)
    code = ("data.not_logged", "info", "") if has_events else ("data.silent", "warn", "")
    assert told(ledger) == [code] and not ledger.loses_data
    assert ledger["gnss"].coverage == pytest.approx(1.0 if has_events else 2.0 / 3.0, abs=0.01)


@pytest.mark.parametrize(
    ("values", "told"), [([1.0, 0.0], True), ([0.0, 1.0], False), ([0.0, np.nan], False), (["abc", "0 or 1"], False)]
)
def test_the_last_setting_counts_and_no_text_or_nan_is_one(values: list[float] | list[str], told: bool) -> None:
    names = Column(np.array(["LOG_DISARMED", "LOG_DISARMED"]))
    assert says_no_log_while_disarmed(names, Column(np.array(values))) is told
