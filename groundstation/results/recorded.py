"""Line on a recording as a person would say it: what it holds and how whole it is."""

from collections.abc import Iterable, Mapping

from groundstation.base.ledger import TRUNCATED, Ledger, TopicEntry
from groundstation.base.signals import BUS_PREFIX, RAW_PREFIX, is_canonical, kind_of, without_icd
from groundstation.base.words import IN_MS_BELOW_S, clock_text, counted, length_text, listed
from groundstation.results.flight import SIMULATED_BY, FlightResults
from groundstation.results.roles import WordsOfRecord

# Kinds of signals in the order they are named, and their names for people; others are counted.
NAMES: Mapping[str, str] = {
    "gnss": "GNSS",
    "ins": "INS",
    "odometry": "odometry",
    "magnetometer": "magnetometer",
    "baro": "barometer",
    "air": "air data",
    "radio_altimeter": "radio altimeter",
    "guidance": "guidance",
    "link": "ranges",
    "adf": "bearings",
    "imu": "IMU",
}
MOST_NAMED = 4
MOST_RAW = 2
ATTITUDE = frozenset(("roll_deg", "pitch_deg"))
HEADINGS = frozenset(("true_heading_deg", "magnetic_heading_deg"))
MOVES = frozenset(("latitude_deg", "velocity_north_mps", "north_m", "position_north_m"))
HOUR_S = 3600
CUT_OFF = "its end is cut off"
FEW_S = 120.0  # below it a length is told in seconds
MOST_OF_IT = 0.95  # of a log: signals that last as long are as long as the log
GREAT_LOSS = 0.05  # share of the time of GNSS or INS, from which a loss is what a report opens with


def recorded(results: FlightResults) -> str:
    """Return what was recorded and how whole it is.

    Examples
    --------
    >>> from groundstation.results.flight import Source
    >>> nothing = FlightResults("NOTIME", Source("a.csv", "0" * 64, 1, "flat-csv"), {}, None, 0.0, "ok")
    >>> recorded(nothing)
    'no signals; nothing lost'
    """
    return f"{contents(results)}; {wholeness(results)}"


def simulated(results: FlightResults) -> str:
    """Return ``simulated vehicle (SIMSTATE)`` where a simulator made the log; else nothing."""
    told = results.metadata.get(SIMULATED_BY, "")
    return f"simulated vehicle ({told})" if told else ""


def contents(results: FlightResults) -> str:
    """Return the length and the kinds of signals with their rates, the telling ones first."""
    ledger, told = results.ledger, words(results)
    kinds = [found for kind in NAMES if (found := _kind(ledger, kind, told.get(kind, "")))]
    if not kinds:
        return _raw(results)
    length = max((one.span_s for name, one in ledger.topics.items() if is_canonical(name)), default=0.0)
    paused_s = _paused_s(ledger)
    length = max(length - paused_s, 0.0)
    shown = ", ".join(_by_rate(kinds[:MOST_NAMED]))
    more = len(kinds) - MOST_NAMED
    also = f", beside {more} more" if more > 0 else ""
    if not length:
        return f"{shown}{also}"
    whole_s = results.duration_s - paused_s
    part = f" in a log of {_of_log(whole_s)}" if length < MOST_OF_IT * whole_s else ""
    return f"{_of_log(length)} of {shown}{also}{part}"


def words(results: FlightResults) -> Mapping[str, str]:
    """Return what answers say of the signals themselves, by kind: "RTK fixed 65 %"."""
    role = results.answer_meeting(WordsOfRecord)
    return {} if role is None else role.words_of_record


def wholeness(results: FlightResults) -> str:
    """Return what was lost, or that nothing was."""
    ledger = results.ledger
    places = sum(1 for one in ledger.damages if one.loses_data and one.kind != TRUNCATED)
    lost = (
        _cut(ledger),
        counted(places, "damaged place") if places else "",
        _gaps(ledger),
        f"the recorder paused for {ledger.dropouts.total_s:.3g} s" if ledger.dropouts.count else "",
    )
    found = [text for text in lost if text]
    told = found or ["nothing lost" if results.status != "degraded" else "some of it lost"]
    return "; ".join(filter(None, (*told, _pauses(ledger))))


def _cut(ledger: Ledger) -> str:
    """Return that the end of a log is cut off, with the bytes of a record begun."""
    cut = ledger.truncated
    if cut is None:
        return ""
    return (
        f"{CUT_OFF} ({counted(cut.count, 'byte')} left of a record)" if cut.what.startswith("bytes of a") else CUT_OFF
    )


def clock_steps(results: FlightResults) -> str:
    """Return the step of the recorder's clock; empty without one.

    Of several it is their number and the greatest.
    """
    sizes = [one.size_s for one in results.clock.steps]
    if not sizes:
        return ""
    size_s = max(sizes, key=abs)
    told = f"{size_s:+.3g} s" if abs(size_s) < FEW_S else f"{'-' if size_s < 0.0 else '+'}{clock_text(size_s)}"
    return f"clock step {told}" if len(sizes) == 1 else f"{len(sizes)} clock steps, up to {told}"


def great_loss(results: FlightResults) -> str:
    """Return the loss that comes before every answer, empty where there is none.

    It is one of a log that is damaged, and takes at least 5 % of the time of its GNSS or INS.
    """
    if results.status == "ok":
        return ""
    topic, share = max(
        ((name, _share(one)) for name, one in results.ledger.topics.items() if kind_of(name) in ("gnss", "ins")),
        key=lambda one: one[1],
        default=("", 0.0),
    )
    if share < GREAT_LOSS:
        return ""
    gaps, percent = results.ledger.topics[topic].gaps, 100.0 * share
    return (
        f"{_length(gaps.total_s)} of {_name(topic)} missing ({percent:.0f} %), {_longest(gaps.count, gaps.longest_s)}"
    )


def _kind(ledger: Ledger, kind: str, told: str) -> tuple[str, str] | None:
    """Return a kind and its rate in words; None where the log has no values of it."""
    topics = {name: one for name, one in ledger.topics.items() if kind_of(name) == kind and _present(one)}
    if not topics:
        return None
    name = NAMES[kind] if kind != "ins" else _of_ins(topics.values())
    several = f"{len(topics)} x {name}" if len(topics) > 1 else name
    rates = sorted(filter(None, map(_rate, topics.values())))
    ends = dict.fromkeys(map(_hertz, rates[:1] + rates[-1:]))
    told_rate = f"at {' to '.join(ends)} Hz" if rates else counted(sum(one.rows for one in topics.values()), "row")
    return f"{several} ({told})" if told else several, told_rate


def _rate(topic: TopicEntry) -> float | None:
    """Return the rate of a topic: as it was logged, of one with gaps as it was between them."""
    return topic.nominal_rate_hz if topic.gaps.count or not topic.nominal_rate_hz else topic.actual_rate_hz


def _by_rate(kinds: list[tuple[str, str]]) -> list[str]:
    """Return the kinds, those of one rate together, in the order of the first of them."""
    by_rate: dict[str, list[str]] = {}
    for name, rate in kinds:
        by_rate.setdefault(rate, []).append(name)
    return [
        f"{listed(names)} {rate}" if rate.startswith("at ") else f"{listed(names)} ({rate})"
        for rate, names in by_rate.items()
    ]


def _hertz(rate: float) -> str:
    """Return a rate: whole where it is within 1 % of a whole one."""
    whole = round(rate)
    return f"{whole}" if whole and abs(rate - whole) < 0.01 * whole else f"{rate:.2g}" if rate < 10.0 else f"{whole}"


def _of_ins(topics: Iterable[TopicEntry]) -> str:
    """Return what the topics of an INS hold: a whole INS, attitude, or heading alone."""
    fields = frozenset(name for one in topics for name in _present(one))
    if fields & MOVES:
        return NAMES["ins"]
    return "attitude" if fields & ATTITUDE else "heading" if fields & HEADINGS else "inertial sensors"


def _present(topic: TopicEntry) -> tuple[str, ...]:
    return tuple(name for name, one in topic.fields.items() if one.present)


def unnamed_buses(ledger: Ledger) -> int:
    """Return the number of bus channels whose words no ICD names; 0 of a log with signals."""
    if any(is_canonical(name) and _present(one) for name, one in ledger.topics.items()):
        return 0
    return sum(name.startswith(BUS_PREFIX) and one.rows > 0 for name, one in ledger.topics.items())


def _raw(results: FlightResults) -> str:
    """Return the messages of a log without signals; of buses, what names them."""
    length = f"{_of_log(results.duration_s)} of " if results.duration_s > 0.0 else ""
    if count := unnamed_buses(results.ledger):
        return f"{length}{without_icd(count)}"
    topics = sorted(
        ((name, one) for name, one in results.ledger.topics.items() if name.startswith(RAW_PREFIX)),
        key=lambda pair: -pair[1].rows,
    )
    if not topics:
        return "no signals"
    named = [f"{name.removeprefix(RAW_PREFIX)} ({one.rows})" for name, one in topics[:MOST_RAW]]
    more = len(topics) - len(named)
    shown = listed([*named, counted(more, "more kind")] if more > 0 else named)
    return f"{length}messages without navigation: {shown}"


def _gaps(ledger: Ledger) -> str:
    """Return the gaps of the GNSS or INS that misses most; empty where none has any."""
    known = {name: one for name, one in ledger.topics.items() if is_canonical(name) and one.gaps.count}
    if not known:
        return ""
    name, one = max(known.items(), key=lambda pair: (kind_of(pair[0]) in ("gnss", "ins"), pair[1].gaps.total_s))
    return f"{_length(one.gaps.total_s)} of {_name(name)} missing, {_longest(one.gaps.count, one.gaps.longest_s)}"


def _pauses(ledger: Ledger) -> str:
    """Return the time that was left out on purpose; empty where there is none."""
    return f"nothing logged for {_length(_paused_s(ledger))} while disarmed" if ledger.pauses else ""


def _paused_s(ledger: Ledger) -> float:
    return sum(one.length_s for one in ledger.pauses)


def _longest(count: int, longest_s: float) -> str:
    return "in one gap" if count == 1 else f"{count} gaps, the longest {_length(longest_s)}"


def _share(topic: TopicEntry) -> float:
    return topic.gaps.total_s / topic.span_s if topic.span_s else 0.0


def _name(topic: str) -> str:
    kind = kind_of(topic)
    return NAMES.get(kind, kind) + topic.removeprefix(kind).replace(".", " ")


def _of_log(seconds: float) -> str:
    """Return the length of a log or of its signals, as its page tells it where it is short."""
    return length_text(seconds) if 0.0 < seconds < IN_MS_BELOW_S else _length(seconds)


def _length(seconds: float) -> str:
    """Return a length of time for people: "26 s", "2:14 min", "1:05:10 h"."""
    if seconds < FEW_S:
        return f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.2g} s"
    return f"{clock_text(seconds)} {'h' if round(seconds) >= HOUR_S else 'min'}"
