"""Text that a computer wrote around the sentences it recorded.

Time stamps in front of them, words and marks behind.

``2024-05-06 12:00:00.123 COM3> $GNGGA,...*6D``: the text of a line is believed to be the computer's where it has the
shape of many others. Its time is the time of arrival by the clock of that computer (:mod:`host_times`).
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from itertools import islice

from groundstation.base.dataclasses import dataclass
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver.checksums import is_sentence

LOOKED_AT, GLANCED_AT, TEXT_BYTES = 1 << 16, 1 << 14, 1 << 10
FEWEST = 3  # sentences in text, before a log is believed to be of that kind
_MOST_LINES, _MOST_STARTS = 2_000, 4  # lines that are looked at, and sentence starts in each
_SHARE_OF_SENTENCES = 0.5
_SHARE_OF_SHAPE = 0.05
_SHARE_WITH_TIME = 0.9
_BARE = re.compile(rb"\$[A-Z]{2}(?:GGA|GLL|GNS|GSA|GST|GSV|HDT|RMC|THS|VTG|ZDA),[^\r\n$*]{0,500}(?=[\r\n]|\Z)")
# Each branch begins with one byte: then re passes quickly over what begins none.
_IN_TEXT = re.compile(rb"\$(?<=[ -~\t].)[A-Z][A-Z0-9]{2}|!(?<=[ -~\t].)[A-Z][A-Z0-9]{2}|\*[0-9A-Fa-f]{2}[ -~\t]")
_BINARY = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1a\x1c-\x1f]")  # bytes that no text has
_LINES = re.compile(rb"[\r\n]+")
_BEFORE = re.compile(rb"[ -~\t]*")
_START = re.compile(rb"[$!](?=[A-Z])")
_BEHIND = re.compile(rb"[$!][^*\r\n]*\*[0-9A-Fa-f]{2}([^\r\n]*)")
FIRST_YEAR, LAST_YEAR = 1990, 2200  # other years are none of a log
_SHAPES = ((re.compile(rb"\d+"), b"0"), (re.compile(rb"[A-Za-z]+"), b"a"), (re.compile(rb"[ \t]+"), b" "))


def shape_of(text: bytes) -> bytes:
    """Return the shape of a text: one mark for each run of digits, letters or spaces.

    Examples
    --------
    >>> shape_of(b"2024-05-06 12:00:00.123 COM3> ")
    b'0-0-0 0:0:0.0 a0> '
    """
    for pattern, word in _SHAPES:
        text = pattern.sub(word, text)
    return text


DATE, DAY, ELAPSED = "date and time", "time of the day", "seconds"
_FRACTION = r"(?:[.,](?P<fraction>\d{1,9}))?"
_TIME = rf"(?P<hour>\d\d?):(?P<minute>\d\d):(?P<second>\d\d){_FRACTION}(?:\s?(?P<half>[AaPp])\.?[Mm])?"
_PLAIN_TIME = rf"(?P<hour>\d\d):?(?P<minute>\d\d):?(?P<second>\d\d){_FRACTION}"
_ZONE = r"\s?(?:(?P<utc>Z|UTC|GMT)|(?P<zone>[+-]\d\d:?\d\d)(?!\d))?"
_GAP = r"[ T_,;\t-]{1,3}"


@dataclass(frozen=True)
class HostClock:
    """Form in which a computer writes a time: its kind and a pattern.

    Kinds are :data:`DATE`, :data:`DAY` and :data:`ELAPSED`.

    Examples
    --------
    >>> [clock.read(b"[12:00:01.5] COM3> ") for clock in CLOCKS if clock.kind == DAY]
    [43201500000000]
    """

    kind: str
    pattern: re.Pattern[bytes]

    def read(self, text: bytes) -> int | None:
        """Read the time in a text, in nanoseconds.

        They count from 1970, midnight, or the clock's own zero. None where the text has no time.
        """
        match = self.pattern.search(text)
        if match is None:
            return None
        cells = {name: cell.decode("ascii") for name, cell in match.groupdict().items() if cell}
        return _READ[self.kind](cells)

    def tells_zone(self, text: bytes) -> bool:
        """Tell whether the text states the offset of its time from UTC.

        Seconds since 1970 are UTC.
        """
        match = self.pattern.search(text)
        cells = {} if match is None else match.groupdict()
        return any(cells.get(name) for name in ("utc", "zone", "epoch"))


def _of_date(cells: Mapping[str, str]) -> int | None:
    if "epoch" in cells:
        below = cells.get("subseconds", cells.get("fraction", ""))
        return int(cells["epoch"]) * NS_PER_S + int(below[:9].ljust(9, "0"))
    try:
        date = datetime(int(cells["year"]), int(cells["month"]), int(cells["day"]), tzinfo=UTC)
    except ValueError:
        return None
    day_ns = _of_day(cells)
    if day_ns is None or not FIRST_YEAR <= date.year < LAST_YEAR:
        return None
    zone = cells.get("zone", "+0000").replace(":", "")
    zone_s = (int(zone[1:3]) * 60 + int(zone[3:])) * 60 * (-1 if zone[0] == "-" else 1)
    return int(date.timestamp()) * NS_PER_S + day_ns - zone_s * NS_PER_S


def _of_day(cells: Mapping[str, str]) -> int | None:
    hour, minute, second = (int(cells[name]) for name in ("hour", "minute", "second"))
    if "half" in cells:
        hour = hour % 12 + (12 if cells["half"] in "Pp" else 0)
    if hour > 23 or minute > 59 or second > 60:
        return None
    return ((hour * 60 + minute) * 60 + second) * NS_PER_S + _fraction(cells)


def _of_zero(cells: Mapping[str, str]) -> int | None:
    return int(cells["seconds"]) * NS_PER_S + _fraction(cells)


def _fraction(cells: Mapping[str, str]) -> int:
    return int(cells.get("fraction", "")[:9].ljust(9, "0"))


_READ: Mapping[str, Callable[[Mapping[str, str]], int | None]] = {DATE: _of_date, DAY: _of_day, ELAPSED: _of_zero}
_PATTERNS = (
    (DATE, rf"(?<!\d)(?P<year>\d{{4}})[-/.]?(?P<month>\d\d)[-/.]?(?P<day>\d\d){_GAP}{_PLAIN_TIME}{_ZONE}"),
    (DATE, rf"(?<!\d)(?P<day>\d\d)\.(?P<month>\d\d)\.(?P<year>\d{{4}}){_GAP}{_PLAIN_TIME}{_ZONE}"),
    (DATE, r"(?<!\d)(?P<epoch>1\d{9})(?:(?P<subseconds>\d{9}|\d{6}|\d{3})|\.(?P<fraction>\d{1,9}))?(?!\d)"),
    (DAY, rf"(?<!\d){_TIME}"),
    (ELAPSED, r"(?<![\d.:-])(?P<seconds>\d{1,9})\.(?P<fraction>\d{1,9})(?![\d.:])"),
)
CLOCKS = tuple(HostClock(kind, re.compile(text.encode())) for kind, text in _PATTERNS)


def _clock_of(texts: list[bytes]) -> HostClock | None:
    """Return the first clock that reads a time in nearly all texts."""
    least = _SHARE_WITH_TIME * len(texts)
    return next((one for one in CLOCKS if sum(one.read(text) is not None for text in texts) >= least), None)


@dataclass(frozen=True)
class HostText:
    """Form of the text that a computer wrote around the sentences.

    Parameters
    ----------
    before, behind : frozenset of bytes
        Shapes of the text in front of sentences and behind them.
    example : str
        The first such text, in front of sentences or behind them as ``clock_is_before`` says.
    clock : HostClock or None
        How the time in the text is written; None where it has none.
    clock_is_before : bool
        Whether that text stands in front of the sentences.
    """

    before: frozenset[bytes]
    behind: frozenset[bytes]
    example: str
    clock: HostClock | None
    clock_is_before: bool

    @property
    def tells_zone(self) -> bool:
        """Tell whether the text states the offset of its time from UTC."""
        return self.clock is not None and self.clock.tells_zone(self.example.encode("ascii", "replace"))

    def accepts(self, text: bytes, is_before: bool) -> bool:
        """Tell whether a text is the computer's.

        It is when it has the shape of many others, or a time as they have.
        """
        if shape_of(text) in (self.before if is_before else self.behind):
            return True
        if b"$" in text:  # a sentence that is damaged
            return False
        return self.clock is not None and is_before == self.clock_is_before and self.clock.read(text) is not None


def find(head: bytes) -> HostText | None:
    """Find the text that a computer wrote around the sentences at the beginning of a log.

    None where most sentences stand alone.

    Examples
    --------
    >>> line = b"12:00:0%d.5 $GPHDT,123.4,T*31\\\\r\\\\n"
    >>> found = find(b"".join(line % second for second in range(4)).replace(b"\\\\r\\\\n", b"\\r\\n"))
    >>> found.clock.kind, find(b"$GPHDT,123.4,T*31\\r\\n" * 4)
    ('time of the day', None)
    """
    if (
        _BINARY.search(head, 0, TEXT_BYTES)
        or sum(1 for _ in islice(_IN_TEXT.finditer(head, 0, GLANCED_AT), FEWEST)) < FEWEST
    ):
        return None
    before, behind, alone = list[bytes](), list[bytes](), 0
    for text, rest in _around_sentences(head[:LOOKED_AT]):
        if text or rest:
            before.append(text)
            behind.append(rest)
        else:
            alone += 1
    if len(before) < FEWEST or len(before) < _SHARE_OF_SENTENCES * (len(before) + alone):
        return None
    is_before = _clock_of(before) is not None or (_clock_of(behind) is None and any(before))
    texts = before if is_before else behind
    example = next(text for text in texts if text).decode("ascii", "replace")
    return HostText(_shapes(before), _shapes(behind), example, _clock_of(texts), is_before)


def _around_sentences(head: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the text before and after the sentence of each line that has one.

    The checksum of the sentence must be right. One without a checksum counts where its formatter is well known.
    """
    for line in _LINES.split(head)[:_MOST_LINES]:
        for match in islice(_START.finditer(line), _MOST_STARTS):
            end, bare = _BEHIND.match(line, match.start()), _BARE.match(line, match.start())
            is_sound = bare or (end and is_sentence(line, match.start()))
            if is_sound and _BEFORE.fullmatch(line, 0, match.start()):
                yield line[: match.start()], end[1] if end else b""
                break


def _shapes(texts: list[bytes]) -> frozenset[bytes]:
    """Return the shapes that many texts have."""
    counts = Counter(shape_of(text) for text in texts if text)
    return frozenset(shape for shape, count in counts.items() if count >= max(2, _SHARE_OF_SHAPE * len(texts)))
