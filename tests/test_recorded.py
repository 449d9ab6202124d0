"""The line on a recording: what it holds, how whole it is, and when a loss comes before every answer."""

from dataclasses import replace

import pytest

from groundstation.base.ledger import DamageEntry, FieldEntry, Ledger, PauseEntry, TopicEntry, TopicGaps, Truncation
from groundstation.base.signals import HOW_TO_NAME
from groundstation.chapters.front import front
from groundstation.chapters.parts import Facts, Mark, Rank
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.results.gates import Gate
from groundstation.results.recorded import contents, great_loss, recorded, wholeness
from groundstation.systems import systems
from groundstation.systems.heading.claim_chapter import claim
from tests.report_example import example, heading_result
from tests.told import next_steps

MADE = example(None)


def topic(rate_hz: float | None, span_s: float, *fields: str, gaps: tuple[float, ...] = ()) -> TopicEntry:
    return TopicEntry(
        actual_rate_hz=rate_hz,
        backward_steps=0,
        coverage=None,
        duplicates=0,
        fields={name: FieldEntry(present=3) for name in fields},
        first="",
        gaps=TopicGaps(count=len(gaps), longest_s=max(gaps, default=0.0), total_s=sum(gaps)),
        last="",
        nominal_rate_hz=rate_hz,
        rows=3,
        span_s=span_s,
        stray_rows=0,
    )


def flight(status: str = "ok", **topics: TopicEntry) -> FlightResults:
    named = {name.replace("_2", ".2").replace("raw_", "raw."): one for name, one in topics.items()}
    spans_s = [one.span_s for name, one in topics.items() if not name.startswith("raw")]
    return replace(MADE, ledger=Ledger(topics=named), status=status, duration_s=max(spans_s, default=0.0) or 90.0)


@pytest.mark.parametrize(
    ("topics", "line"),
    [
        ({"gnss": topic(4.0, 134.0, "latitude_deg")}, "2:14 min of GNSS at 4 Hz"),
        (
            {"gnss": topic(0.999, 4000.0, "latitude_deg"), "ins": topic(1.0, 3990.0, "roll_deg")},
            "1:06:40 h of GNSS and attitude at 1 Hz",
        ),
        (
            {"ins": topic(50.0, 61.2, "latitude_deg"), "ins_2": topic(50.0, 61.0, "roll_deg")},
            "61 s of 2 x INS at 50 Hz",
        ),
        ({"ins": topic(50.0, 61.2, "true_heading_deg")}, "61 s of heading at 50 Hz"),
        ({"gnss": topic(5.0, 9.0)}, "no signals"),  # a topic all of whose values are absent
        ({"gnss": topic(None, 0.0, "latitude_deg")}, "GNSS (3 rows)"),
        ({"raw_chatter": topic(9.0, 9.0, "data")}, "90 s of messages without navigation: chatter (3)"),
    ],
)
def test_contents_are_told_as_a_person_would(topics: dict[str, TopicEntry], line: str) -> None:
    assert contents(flight(**topics)) == line


def test_wholeness_names_the_end_the_places_and_the_gaps() -> None:
    assert wholeness(flight(gnss=topic(1.0, 90.0, "latitude_deg"))) == "nothing lost"
    gaps = flight(gnss=topic(1.0, 200.0, "latitude_deg", gaps=(9.0, 4.0)))
    assert wholeness(gaps) == "13 s of GNSS missing, 2 gaps, the longest 9 s"
    damage = DamageEntry(count=7, kind="corrupt", loses_data=True, place="byte 3", topic="", what="bytes")
    cut = Ledger(damages=(damage,), truncated=Truncation(count=1, place="", what=""))
    assert recorded(replace(MADE, ledger=cut, status="degraded")).endswith("its end is cut off; 1 damaged place")
    assert wholeness(replace(MADE, status="degraded")) == "some of it lost", "never whole where data were lost"


def cut_at_its_end(what: str, *more: str) -> FlightResults:
    damages = tuple(
        DamageEntry(count=41, kind=kind, loses_data=True, place="bytes 55 to 95", topic="", what=what)
        for kind in ("truncated", *more)
    )
    ledger = Ledger(damages=damages, truncated=Truncation(count=41, place="bytes 55 to 95", what=what))
    return replace(MADE, ledger=ledger, status="degraded")


def test_a_cut_end_is_one_statement_of_its_weight() -> None:
    chapters = systems().chapters
    unfinished = cut_at_its_end("bytes of a frame that the end of the file cuts off")
    assert unfinished.ledger.loss == "end cut off"
    status = dict(front(unfinished, chapters).pairs)["Status"]
    assert status == Mark("warn", "degraded: its end is cut off (41 bytes left of a record)")
    assert "the recorder" not in told_advice(unfinished) and "copied" not in told_advice(unfinished)
    not_whole = cut_at_its_end("bytes cut off")
    assert dict(front(not_whole, chapters).pairs)["Status"] == Mark("warn", "degraded: its end is cut off")
    assert "That the log was copied whole: its end is cut off." in told_advice(not_whole)
    damaged = cut_at_its_end("bytes of a frame that the end of the file cuts off", "corrupt")
    assert damaged.ledger.loss == "data lost" and "The recorder: data were lost." in told_advice(damaged)
    assert dict(front(damaged, chapters).pairs)["Status"] == Mark("warn", "degraded: data were lost")


def told_advice(results: FlightResults) -> str:
    section = next_steps(results)
    return "" if section is None else " ".join(str(pair) for part in section.parts for pair in part.pairs)  # type: ignore[attr-defined]


def test_a_great_loss_comes_before_a_good_number() -> None:
    chapters = systems().chapters
    kept = replace(example(heading_result()), ledger=Ledger(topics={"gnss": topic(1.0, 80.0, "latitude_deg")}))
    lost = replace(
        kept, ledger=Ledger(topics={"gnss": topic(1.0, 80.0, "latitude_deg", gaps=(21.0,))}), status="degraded"
    )
    small = replace(
        kept, ledger=Ledger(topics={"gnss": topic(1.0, 800.0, "latitude_deg", gaps=(21.0,))}), status="degraded"
    )
    assert great_loss(lost) == "21 s of GNSS missing (26 %), in one gap"
    top = front(lost, chapters)
    assert (top.verdict, top.others[0].claim.mark.text) == (Mark("bad", "Data lost"), "Accept")
    assert front(kept, chapters).verdict == Mark("good", "Accept")
    assert great_loss(small) == "" and front(small, chapters).verdict == Mark("good", "Accept")


def test_too_little_taxi_decides_nothing() -> None:
    short = Gate("taxi_seconds", "straight taxi", 3.0, 20.0, "s", "failed", sense="at_least")
    assert claim(heading_result(verdict="reject", gates=(short,))).rank is Rank.HEADING_OPEN
    assert claim(heading_result(verdict="reject")).rank is Rank.HEADING


def test_a_pause_while_disarmed_is_told_apart_from_losses_and_is_no_recorded_time() -> None:
    whole = flight(gnss=topic(5.0, 80.0, "latitude_deg"))
    pause = PauseEntry(length_s=21.2, start="", start_s=9.2)
    paused = replace(whole, ledger=replace(whole.ledger, pauses=(pause,)))
    assert contents(whole) == "80 s of GNSS at 5 Hz" and contents(paused) == "59 s of GNSS at 5 Hz"
    assert wholeness(paused) == "nothing lost; nothing logged for 21 s while disarmed"


def test_rates_of_several_units_are_a_range_as_they_were_logged() -> None:
    """Five INS of a real recording came at 80, 53, 10, 52 and 10 Hz, and the line said "5 x INS at 82 Hz"."""
    first = replace(topic(82.3, 0.25, "roll_deg", "latitude_deg"), actual_rate_hz=79.96)
    second = replace(topic(9.9998, 0.2, "latitude_deg"), actual_rate_hz=9.9998)
    assert contents(flight(ins=first, ins_2=second)) == "0.25 s of 2 x INS at 10 to 80 Hz"
    holed = replace(topic(50.0, 100.0, "latitude_deg", gaps=(60.0,)), actual_rate_hz=20.0)
    assert contents(flight(ins=holed)) == "100 s of INS at 50 Hz", "a gap is no rate"


def test_the_length_is_that_of_the_page_to_the_millisecond_where_it_is_short() -> None:
    short = replace(flight(ins=topic(50.0, 0.25, "latitude_deg")), duration_s=0.6537)
    assert contents(short) == "0.25 s of INS at 50 Hz in a log of 0.654 s"
    assert dict(front(short, systems().chapters).pairs)["Duration"] == "0.654 s"
    longer = replace(short, duration_s=9.9996)
    assert dict(front(longer, systems().chapters).pairs)["Duration"] == "0:10 min:s"


def test_a_cut_end_of_bus_words_is_no_fault_of_the_recorder() -> None:
    words = Ledger(topics={"raw.bus.1553.4": topic(None, 0.3, "word")})
    cut = cut_at_its_end("packet that the end of the file cuts off")
    told = told_advice(replace(cut, ledger=replace(cut.ledger, topics=words.topics)))
    assert "--icd" in told and "that the log was copied whole: its end is cut off" in told
    assert "the recorder" not in told


def test_bus_words_without_an_icd_say_what_names_them() -> None:
    """The line and the advice said "messages without navigation" and to record what the buses may well carry."""
    words = {f"raw.bus.{name}": topic(None, 0.3, "word") for name in ("1553.4", "429.7")}
    missing = (NotAssessable("heading", "no GNSS velocity in the log"),)
    found = replace(MADE, ledger=Ledger(topics=words), duration_s=0.654, not_assessable=missing)
    assert contents(found) == f"0.654 s of words of 2 bus channels without ICD: {HOW_TO_NAME}"
    assert "--icd" in HOW_TO_NAME and "--suggest-icd" in HOW_TO_NAME
    section = next_steps(found)
    assert section is not None
    (part,) = section.parts
    assert isinstance(part, Facts) and [line for line, _, _ in part.pairs] == ["Check"]
    assert "--icd FILE" in part.pairs[0][1] and "GNSS velocity" not in str(section)
    named = replace(found, ledger=Ledger(topics={**words, "ins": topic(9.0, 0.3, "roll_deg")}))
    assert contents(named).startswith("0.3 s of attitude") and "GNSS velocity" in str(next_steps(named))
