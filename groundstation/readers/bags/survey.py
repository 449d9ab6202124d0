"""First pass over a bag: which messages serve which topic, and which clock is believed.

One of three clocks tells when values were true.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import field, replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Remark
from groundstation.base.signals import field_of, kind_of
from groundstation.readers.bags import px4
from groundstation.readers.bags.bag import Bag
from groundstation.readers.bags.canonical import MESSAGES, imu_samples, is_earth_frame, wheel_odometry
from groundstation.readers.bags.clocks import LARGEST_LAG_S, Lags, offsets_of, told, was_set
from groundstation.readers.bags.decode import Decoder
from groundstation.readers.bags.messages import ConnectionBlock
from groundstation.readers.bags.profile import MessageProfile
from groundstation.readers.bags.seen import SeenMessages
from groundstation.readers.bags.sources import in_order, sources_of
from groundstation.readers.bags.values import Values
from groundstation.readers.bags.work import StepBudget
from groundstation.readers.clock_offsets import Offsets
from groundstation.readers.imu import POINT_SAMPLES
from groundstation.readers.mapping import Columns, mapped

SHARED_SHARE = 0.8  # share of the slower topic's stamps that the faster one must have too, to be one unit
ATTITUDE = ("roll_deg", "pitch_deg", "true_heading_deg")
_ORDER = ("imu", "odometry", "pose", "fix", "twist")  # order in which the messages of a unit give a field
_TURNED = "east-north-up turned to north-east-down, forward-left-up to forward-right-down"


@dataclass(frozen=True)
class TopicFeed:
    """Feed of a canonical topic by the messages of a connection.

    The messages must have the columns ``needs``. ``without`` are fields that another connection gives.
    """

    topic: str
    needs: tuple[str, ...]
    columns: Callable[[Values], Columns]
    without: frozenset[str] = frozenset()

    def of(self, columns: dict[str, Column]) -> Columns:
        """Return the canonical fields that messages with these columns give a value for."""
        if not columns.keys() >= set(self.needs):
            return {}
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # absurd numbers become infinite or NaN
                found = self.columns(Values(columns))
        except KeyError:  # a type of a common name whose definition lacks a field: its messages stay raw
            return {}
        return {
            name: column
            for name, column in found.items()
            if name not in self.without and field_of(self.topic, name) is not None and column.mask.any()
        }


@dataclass
class BagSurvey:
    """Findings of the first pass.

    Attributes
    ----------
    seen : dict of connection number to SeenMessages
    sources : list of SeenMessages
        The same of each source, in the order in which they were first met.
    feeds : dict of connection number to list of TopicFeed
    offsets : Offsets
        How log times are moved, where the recorder's clock was set.
    lags : dict of connection number to Lags
        Of those whose header stamps are believed.
    remarks : list of Remark
    """

    seen: dict[int, SeenMessages] = field(default_factory=dict)
    sources: list[SeenMessages] = field(default_factory=list)
    feeds: dict[int, list[TopicFeed]] = field(default_factory=dict)
    offsets: Offsets = field(default_factory=Offsets)
    lags: dict[int, Lags] = field(default_factory=dict)
    remarks: list[Remark] = field(default_factory=list)

    @property
    def is_set(self) -> bool:
        """Tell whether a clock was set: the log time of a topic falls or leaps from 1970.

        The fall is a second or more; the log time is the corrected one.
        """
        return any(was_set(one.jumps, self.offsets) for seen in self.seen.values() for one in seen.stamped)


def survey(bag: Bag, profile: MessageProfile | None = None) -> BagSurvey:
    """Read the times of all messages of a bag, and the content of the first of each topic.

    ``profile`` says what some of them mean.
    """
    found = BagSurvey()
    decoders: dict[int, Decoder] = {}
    work = StepBudget.of(bag.size).of_a_first_look()
    for part in bag:
        if isinstance(part, ConnectionBlock) and len(part):
            number = part.connection.number
            decoder = decoders.setdefault(number, Decoder(part.connection, work=work))
            if number not in found.seen:
                rule = profile.rule_for(part.connection) if profile is not None else None
                found.seen[number] = SeenMessages(part.connection, (number,), rule)
            found.seen[number].take(part, decoder)
    lines = [seen.stamped[0].line(seen.connection) for seen in found.seen.values()]
    found.sources = [SeenMessages.of([found.seen[number] for number in source]) for source in sources_of(lines)]
    _map(found)
    _choose_clock(found)
    return found


def _map(found: BagSurvey) -> None:
    """Map the messages to canonical topics, those of the profile first."""
    named = _map_by_rules(found)
    served = [seen for seen in found.sources if seen.rule is None and _serves(seen)]
    units = _units([seen for seen in served if MESSAGES[seen.connection.type].role in _ORDER])
    kinds: dict[str, list[list[SeenMessages]]] = {}
    for unit in units:
        kinds.setdefault(_kind_of(unit), []).append(unit)
    alone = [seen for seen in served if MESSAGES[seen.connection.type].role not in _ORDER]
    kinds.setdefault("magnetometer", []).extend([seen] for seen in alone)
    for seen in (seen for unit in kinds.pop("", []) for seen in unit):
        _leave_raw(found, seen, "whose it is and along which axes is not told; a profile can say it")
    for kind in sorted(kinds.keys() & named):
        for one in (seen for unit in kinds.pop(kind) for seen in unit):
            _leave_raw(found, one, f"the profile says what {kind} is")
    for kind, several in kinds.items():
        several.sort(key=lambda unit: (-len(unit), in_order(unit[0].connection)))
        for place, unit in enumerate(several, start=1):
            topic = kind if len(several) == 1 else f"{kind}.{place}"
            _feed(found, topic, unit)
    _feed_imu(found, named)
    px4.feed({seen.connection.number: seen for seen in found.sources}, found.feeds, found.remarks, TopicFeed)
    for seen in found.sources:
        for number in seen.numbers[1:]:
            if seen.connection.number in found.feeds:
                found.feeds[number] = found.feeds[seen.connection.number]
    found.remarks += mapped(_named_sources(found))


def _named_sources(found: BagSurvey) -> dict[str, list[str]]:
    """Return the topics of the log that feed each canonical topic.

    With their publishers where several write one topic.
    """
    writers = Counter(seen.connection.topic for seen in found.sources)
    sources: dict[str, list[str]] = {}
    for seen in found.sources:
        topic = seen.connection.topic
        name = topic if writers[topic] == 1 else f"{topic} ({seen.connection.publisher})"
        for feed in found.feeds.get(seen.connection.number, ()):
            sources.setdefault(feed.topic, []).append(name)
    return sources


def _serves(seen: SeenMessages) -> bool:
    message = MESSAGES.get(seen.connection.type)
    return message is not None and all(name in seen.columns for name in message.needs)


def _units(seen: list[SeenMessages]) -> list[list[SeenMessages]]:
    """Group messages of one namespace that share their header stamps into units.

    They are what one unit says of the same instants.
    """
    units: list[list[SeenMessages]] = []
    for one in sorted(seen, key=lambda seen: _ORDER.index(MESSAGES[seen.connection.type].role)):
        fitting = [unit for unit in units if _belongs(one, unit)]
        fitting.sort(key=lambda unit: unit[0].connection.publisher != one.connection.publisher)
        if fitting:
            fitting[0].append(one)
        else:
            units.append([one])
    return units


def _belongs(one: SeenMessages, unit: list[SeenMessages]) -> bool:
    roles = {MESSAGES[other.connection.type].role for other in unit}
    namespaces = {other.connection.topic.rpartition("/")[0] for other in unit}
    if MESSAGES[one.connection.type].role in roles or one.connection.topic.rpartition("/")[0] not in namespaces:
        return False
    few, many = sorted((one.first_stamps, unit[0].first_stamps), key=len)
    return len(few) > 0 and bool(np.isin(few, many).mean() >= SHARED_SHARE)


def _kind_of(unit: list[SeenMessages]) -> str:
    """Return ``ins``, ``gnss`` or ``odometry``, the kind of topic that a unit feeds.

    Empty where a message alone does not tell what it is of.
    """
    roles = {MESSAGES[seen.connection.type].role for seen in unit}
    is_of_earth = is_earth_frame(Values(unit[0].columns))
    if "imu" in roles or ({"odometry", "pose"} & roles and ("fix" in roles or is_of_earth)):
        return "ins"
    if "fix" in roles:
        return "gnss"
    return "odometry" if "odometry" in roles else ""


def _map_by_rules(found: BagSurvey) -> set[str]:
    """Map messages to topics as the profile says; return the kinds of topics it names."""
    kinds: set[str] = set()
    served: dict[int, list[SeenMessages]] = {}
    for seen in sorted(found.sources, key=lambda seen: in_order(seen.connection)):
        if seen.rule is not None:
            served.setdefault(id(seen.rule), []).append(seen)
    for number, seen in ((seen.connection.number, seen) for seen in found.sources):
        if seen.rule is None:
            continue
        several = served[id(seen.rule)]
        for topic in seen.rule.topics:
            name = f"{topic}.{several.index(seen) + 1}" if len(several) > 1 and topic == kind_of(topic) else topic
            found.feeds.setdefault(number, []).append(TopicFeed(name, (), seen.rule.feeding(topic)))
            kinds.add(kind_of(topic))
        text, missing = seen.rule.told(seen.columns)
        found.remarks.append(Remark("profile", f"{seen.connection.topic} by the profile: {text}"))
        if missing:
            text = f"{seen.connection.topic} has no {', '.join(missing)}, which the profile names"
            found.remarks.append(Remark("missing_columns", text))
    return kinds


def _leave_raw(found: BagSurvey, seen: SeenMessages, why: str) -> None:
    text = f"{seen.connection.topic} ({seen.connection.type}) is kept as raw: {why}"
    found.remarks.append(Remark("not_mapped", text))


def _feed(found: BagSurvey, topic: str, unit: list[SeenMessages]) -> None:
    """Map the messages of one unit to a topic.

    A field that two messages have is given by the first in :data:`_ORDER`.
    """
    given: set[str] = set()
    for seen in unit:
        message = MESSAGES[seen.connection.type]
        columns = wheel_odometry if topic.startswith("odometry") else message.columns
        feed = TopicFeed(topic, message.needs, columns, frozenset(given))
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


def _feed_imu(found: BagSurvey, named: set[str]) -> None:
    """Map the messages of every IMU with rates and specific force to an ``imu`` of its own."""
    units = [seen for seen in found.sources if seen.rule is None and _serves(seen)]
    units = [seen for seen in units if MESSAGES[seen.connection.type].role == "imu"]
    feeds = [(seen, TopicFeed("imu", MESSAGES[seen.connection.type].needs, imu_samples)) for seen in units]
    feeds = [(seen, feed) for seen, feed in feeds if feed.of(seen.columns)]
    if "imu" in named:
        return
    feeds.sort(key=lambda one: in_order(one[0].connection))
    for place, (seen, feed) in enumerate(feeds, start=1):
        topic = "imu" if len(feeds) == 1 else f"imu.{place}"
        found.feeds.setdefault(seen.connection.number, []).append(replace(feed, topic=topic))
        text = f"{topic}: {seen.connection.topic}, {_TURNED}; {POINT_SAMPLES}"
        found.remarks.append(Remark("converted", text, topic, tuple(feed.of(seen.columns))))


def _choose_clock(found: BagSurvey) -> None:
    """Choose header stamps as times of validity, if they are of the clock of log time."""
    found.offsets = offsets_of({number: seen.stamped[0] for number, seen in found.seen.items()})
    if found.offsets.stated:
        names = {number: seen.connection.topic for number, seen in found.seen.items()}
        found.remarks.append(Remark("clock_used", told(found.offsets, names)))
    stamped = [(seen, Lags.of(seen.stamped, found.offsets)) for seen in found.sources if seen.has_header]
    mapped = [(seen, lags) for seen, lags in stamped if seen.connection.number in found.feeds and len(lags.lag_ns)]
    others = [(seen, lags) for seen, lags in mapped if not lags.are_good]
    if others:
        seen, worst = max(others, key=lambda one: abs(one[1].usual_ns))
        text = (
            f"log time is used: header stamps of {seen.connection.topic} are {worst.text()} before it, "
            f"more than {LARGEST_LAG_S:g} s"
        )
        found.remarks.append(Remark("clock_used", text))
        return
    found.lags = {number: lags for seen, lags in stamped if lags.are_good for number in seen.numbers}
    if found.lags:
        late = "; ".join(f"{seen.connection.topic} {lags.text()}" for seen, lags in mapped)
        text = "values are valid at their header stamps; log time orders the records and is kept as recorder time"
        found.remarks.append(Remark("clock_used", f"{text}; logged after their stamp: {late}" if late else text))
