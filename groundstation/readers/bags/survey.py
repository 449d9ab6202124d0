"""The first pass over a bag: which messages serve as what, which of three clocks tells when values were true."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from groundstation.base.records import Column, Int64Array, Remark
from groundstation.base.signals import field_of, kind_of
from groundstation.base.units import NS_PER_S
from groundstation.readers.bags import px4
from groundstation.readers.bags.bag import Bag
from groundstation.readers.bags.canonical import MESSAGES, is_earth_frame, wheel_odometry
from groundstation.readers.bags.decode import Decoder
from groundstation.readers.bags.messages import Block, Connection
from groundstation.readers.bags.profile import MessageProfile, MessageRule
from groundstation.readers.bags.values import Values
from groundstation.readers.mapping import Columns, mapped

SAMPLE = 4_000  # messages of a connection that are looked at
LARGEST_LAG_S = 2.0  # between header stamp and log time: what is further apart is another clock
USUAL_SHARE = 0.99  # of the stamps of a topic that must be within it
SHARED_SHARE = 0.8  # of the stamps of the slower of two topics that the faster has too: one unit's solution
STAMPS = ("header.stamp_ns", "timestamp_ns")
ATTITUDE = ("roll_deg", "pitch_deg", "true_heading_deg")
_ORDER = ("imu", "odometry", "pose", "fix", "twist")  # of a unit's messages: who gives a field first
_TURNED = "east-north-up turned to north-east-down, forward-left-up to forward-right-down"


@dataclass(frozen=True)
class Feed:
    """What the messages of a connection that have the columns ``needs`` give to a canonical topic.

    ``without`` are fields that another connection gives.
    """

    topic: str
    needs: tuple[str, ...]
    columns: Callable[[Values], Columns]
    without: frozenset[str] = frozenset()

    def of(self, columns: dict[str, Column]) -> Columns:
        """Fields of the canonical topic that messages with these columns give; those that have a value."""
        if not columns.keys() >= set(self.needs):
            return {}
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # of absurd numbers: becomes infinite or NaN
                found = self.columns(Values(columns))
        except KeyError:  # a type of a common name whose definition lacks a field: its messages stay raw
            return {}
        return {
            name: column
            for name, column in found.items()
            if name not in self.without and field_of(self.topic, name) is not None and column.mask.any()
        }


@dataclass
class Seen:
    """What was seen of one connection.

    Attributes
    ----------
    connection : Connection
    rule : MessageRule, optional
        What the user's profile says of its messages.
    messages : int
    first_ns, last_ns : int
        Log time of the first and the last message.
    steps_back_ns : int
        How far its log time falls at most.
    stamps_ns, lags_ns : ndarray of int64
        Header stamps of a sample, and how long after them the messages were logged.
    columns : dict of str to Column
        Of some of its first messages.
    """

    connection: Connection
    rule: MessageRule | None = None
    messages: int = 0
    first_ns: int = 0
    last_ns: int = 0
    steps_back_ns: int = 0
    stamps_ns: list[Int64Array] = field(default_factory=list)
    lags_ns: list[Int64Array] = field(default_factory=list)
    columns: dict[str, Column] = field(default_factory=dict)

    def take(self, block: Block, decoder: Decoder) -> None:
        """Count a block, and look into it while few messages were looked at."""
        if not self.messages:
            self.first_ns = self.last_ns = int(block.log_time_ns[0])
        times = np.concatenate(([self.last_ns], block.log_time_ns))
        self.steps_back_ns = max(self.steps_back_ns, int((times[:-1] - times[1:]).max()))
        if self.messages < SAMPLE:
            head = block.take(slice(0, SAMPLE - self.messages))
            for part in decoder.decode(head):
                self.columns = self.columns or part.columns
                stamp = self.stamp_of(part.columns)
                if stamp is not None:
                    self.stamps_ns.append(stamp)
                    self.lags_ns.append(head.log_time_ns[part.rows] - stamp)
        self.messages += len(block)
        self.last_ns = int(block.log_time_ns[-1])

    def stamp_of(self, columns: dict[str, Column]) -> Int64Array | None:
        """When values of messages were true by the messages themselves, shape (n,); None where they do not tell."""
        if self.rule is not None and self.rule.time is not None:
            return self.rule.stamp_ns(columns)
        name = next((name for name in STAMPS if name in columns), None)
        if name is not None:
            return columns[name].values.astype(np.int64)
        if px4.is_px4(self.connection.type) and "timestamp" in columns:
            stamp_us = columns["timestamp"].values.astype(np.float64)
            return (np.where(stamp_us < 2.0**52, stamp_us, 0.0) * 1e3).astype(np.int64)
        return None

    @property
    def lags(self) -> Int64Array:
        """All lags of the sample."""
        return np.concatenate(self.lags_ns) if self.lags_ns else np.zeros(0, dtype=np.int64)

    @property
    def stamps(self) -> Int64Array:
        """All stamps of the sample."""
        return np.concatenate(self.stamps_ns) if self.stamps_ns else np.zeros(0, dtype=np.int64)

    @property
    def has_good_stamps(self) -> bool:
        """Whether nearly all stamps are near the log time."""
        return len(self.lags) > 0 and bool(np.mean(np.abs(self.lags) <= LARGEST_LAG_S * NS_PER_S) >= USUAL_SHARE)


@dataclass
class Survey:
    """What the first pass found.

    Attributes
    ----------
    seen : dict of connection number to Seen
    feeds : dict of connection number to list of Feed
    stamped : set of connection numbers
        Those whose header stamps are believed.
    remarks : list of Remark
    """

    seen: dict[int, Seen] = field(default_factory=dict)
    feeds: dict[int, list[Feed]] = field(default_factory=dict)
    stamped: set[int] = field(default_factory=set)
    remarks: list[Remark] = field(default_factory=list)

    @property
    def steps_back(self) -> bool:
        """Whether the log time of a topic falls by a second or more: a clock that was set."""
        return any(seen.steps_back_ns >= NS_PER_S for seen in self.seen.values())


def survey(bag: Bag, profile: MessageProfile | None = None) -> Survey:
    """Look at all messages of a bag, into the first of each topic; ``profile`` says what some of them mean."""
    found = Survey()
    decoders: dict[int, Decoder] = {}
    for part in bag:
        if isinstance(part, Block) and len(part):
            number = part.connection.number
            decoder = decoders.setdefault(number, Decoder(part.connection))
            if number not in found.seen:
                rule = profile.rule_for(part.connection) if profile is not None else None
                found.seen[number] = Seen(part.connection, rule)
            found.seen[number].take(part, decoder)
    _map(found)
    _choose_clock(found)
    return found


def _map(found: Survey) -> None:
    """Lay the messages on canonical topics, those of the profile first."""
    told = _map_by_rules(found)
    served = {number: seen for number, seen in found.seen.items() if seen.rule is None and _serves(seen)}
    units = _units([seen for seen in served.values() if MESSAGES[seen.connection.type].role in _ORDER])
    kinds: dict[str, list[list[Seen]]] = {}
    for unit in units:
        kinds.setdefault(_kind_of(unit), []).append(unit)
    alone = [seen for seen in served.values() if MESSAGES[seen.connection.type].role not in _ORDER]
    kinds.setdefault("magnetometer", []).extend([seen] for seen in alone)
    for seen in (seen for unit in kinds.pop("", []) for seen in unit):
        _leave_raw(found, seen, "whose it is and along which axes is not told; a profile can say it")
    for kind in sorted(kinds.keys() & told):
        for one in (seen for unit in kinds.pop(kind) for seen in unit):
            _leave_raw(found, one, f"the profile says what {kind} is")
    for kind, several in kinds.items():
        several.sort(key=lambda unit: (-len(unit), unit[0].connection.topic))
        for place, unit in enumerate(several, start=1):
            topic = kind if len(several) == 1 else f"{kind}.{place}"
            _feed(found, topic, unit)
    px4.feed(found.seen, found.feeds, found.remarks, Feed)
    sources: dict[str, list[str]] = {}
    for number, feeds in found.feeds.items():
        for feed in feeds:
            sources.setdefault(feed.topic, []).append(found.seen[number].connection.topic)
    found.remarks += mapped(sources)


def _serves(seen: Seen) -> bool:
    message = MESSAGES.get(seen.connection.type)
    return message is not None and all(name in seen.columns for name in message.needs)


def _units(seen: list[Seen]) -> list[list[Seen]]:
    """Messages of one namespace that share their header stamps: what one unit says of the same instants."""
    units: list[list[Seen]] = []
    for one in sorted(seen, key=lambda seen: _ORDER.index(MESSAGES[seen.connection.type].role)):
        unit = next((unit for unit in units if _belongs(one, unit)), None)
        if unit is None:
            units.append([one])
        else:
            unit.append(one)
    return units


def _belongs(one: Seen, unit: list[Seen]) -> bool:
    roles = {MESSAGES[other.connection.type].role for other in unit}
    namespaces = {other.connection.topic.rpartition("/")[0] for other in unit}
    if MESSAGES[one.connection.type].role in roles or one.connection.topic.rpartition("/")[0] not in namespaces:
        return False
    few, many = sorted((one.stamps, unit[0].stamps), key=len)
    return len(few) > 0 and bool(np.isin(few, many).mean() >= SHARED_SHARE)


def _kind_of(unit: list[Seen]) -> str:
    """``ins``, ``gnss``, ``odometry``, or nothing where a message alone does not tell what it is of."""
    roles = {MESSAGES[seen.connection.type].role for seen in unit}
    is_of_earth = is_earth_frame(Values(unit[0].columns))
    if "imu" in roles or ({"odometry", "pose"} & roles and ("fix" in roles or is_of_earth)):
        return "ins"
    if "fix" in roles:
        return "gnss"
    return "odometry" if "odometry" in roles else ""


def _map_by_rules(found: Survey) -> set[str]:
    """Lay messages on topics as the profile says; returns the kinds of topics that it names."""
    kinds: set[str] = set()
    for number, seen in found.seen.items():
        if seen.rule is None:
            continue
        for topic in seen.rule.topics:
            found.feeds.setdefault(number, []).append(Feed(topic, (), seen.rule.feeding(topic)))
            kinds.add(kind_of(topic))
        text, missing = seen.rule.told(seen.columns)
        found.remarks.append(Remark("profile", f"{seen.connection.topic} by the profile: {text}"))
        if missing:
            text = f"{seen.connection.topic} has no {', '.join(missing)}, which the profile names"
            found.remarks.append(Remark("missing_columns", text))
    return kinds


def _leave_raw(found: Survey, seen: Seen, why: str) -> None:
    text = f"{seen.connection.topic} ({seen.connection.type}) is kept as raw: {why}"
    found.remarks.append(Remark("not_mapped", text))


def _feed(found: Survey, topic: str, unit: list[Seen]) -> None:
    """Lay the messages of one unit on a topic; of a field that two have, the first in :data:`_ORDER` gives it."""
    given: set[str] = set()
    for seen in unit:
        message = MESSAGES[seen.connection.type]
        columns = wheel_odometry if topic.startswith("odometry") else message.columns
        feed = Feed(topic, message.needs, columns, frozenset(given))
        fields = feed.of(seen.columns)
        found.feeds.setdefault(seen.connection.number, []).append(feed)
        given |= fields.keys()
        if "true_heading_deg" in fields:
            text = (
                f"{topic}: attitude of {seen.connection.topic}, {_TURNED}; heading is 90 deg minus yaw, "
                "taken as true: ROS does not tell true from magnetic"
            )
            found.remarks.append(Remark("converted", text, topic, ATTITUDE))
        elif any(name.startswith(("velocity", "rate", "accel", "field", "position")) for name in fields):
            found.remarks.append(Remark("converted", f"{topic}: {seen.connection.topic}, {_TURNED}", topic))


def _choose_clock(found: Survey) -> None:
    """Header stamps tell when values were true, unless they are of another clock than the log time."""
    mapped = [seen for number, seen in found.seen.items() if number in found.feeds and len(seen.lags)]
    others = [seen for seen in mapped if not seen.has_good_stamps]
    if others:
        worst = max(others, key=lambda seen: float(np.abs(np.median(seen.lags))))
        text = (
            f"log time is used: header stamps of {worst.connection.topic} are {_lag_text(worst)} before it, "
            f"more than {LARGEST_LAG_S:g} s"
        )
        found.remarks.append(Remark("clock_used", text))
        return
    found.stamped = {number for number, seen in found.seen.items() if seen.has_good_stamps}
    if found.stamped:
        lags = "; ".join(
            f"{seen.connection.topic} {_lag_text(seen)}" for seen in mapped if seen.connection.number in found.stamped
        )
        text = "values are valid at their header stamps; log time orders the records and is kept as recorder time"
        found.remarks.append(Remark("clock_used", f"{text}; logged after their stamp: {lags}" if lags else text))


def _lag_text(seen: Seen) -> str:
    lags_s = np.sort(seen.lags) / NS_PER_S
    low, middle, high = lags_s[0], lags_s[len(lags_s) // 2], lags_s[-1]
    return f"{middle:.3f} s ({low:.3f} to {high:.3f})"
