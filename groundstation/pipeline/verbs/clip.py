"""Verb ``clip``: a part of a flight as an MCAP of its own, and its recording."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError, UnreadableLogError, UsageError, told_in_a_line
from groundstation.base.failures import Failure, attempt, failures, gathered_failures
from groundstation.base.ledger import DamagedSpan, Ledger
from groundstation.base.records import Damage, RecordBatch
from groundstation.base.timescales import iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.integrity.limits import Thresholds
from groundstation.pipeline.many_flights.inputs import file_in
from groundstation.pipeline.one_flight.analyse import analyse
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import Converted, census_of, convert_flight, convert_log, recounted
from groundstation.pipeline.one_flight.flight import OF_THE_WORLD, given_of, read_flight
from groundstation.pipeline.one_flight.identity import flight_id
from groundstation.pipeline.one_flight.intervals import flight_seconds
from groundstation.pipeline.one_flight.log import Log, open_log
from groundstation.pipeline.one_flight.outcome import Outcome, State
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.segments import Segment, segments_in
from groundstation.pipeline.verbs.anonymous import ANONYMOUS, Disguise, disguise_of
from groundstation.pipeline.verbs.describe import facts_of
from groundstation.results.flight import Source

if TYPE_CHECKING:
    from groundstation.store.info import StoreInfo
    from groundstation.store.reader import StorePart

FARTHEST_S = 1e9  # a time further from the flight than this, 32 years, selects the same as one this far
CUT_FROM, CUT_SHA256, ZERO = "clip.source", "clip.source_sha256", "clip.zero_s"


@dataclass(frozen=True)
class Wanted:
    """Part of a flight to cut out.

    Parameters
    ----------
    start, end : str, optional
        From ``start`` on and before ``end``: flight seconds, +mm:ss or ISO UTC; None: the flight's own end.
    topics : tuple of str
        Names or patterns (``*``, ``?``, ``[...]``); none: all topics.
    anonymous : bool
        Without what names the flight (:mod:`groundstation.pipeline.verbs.anonymous`).
    seed : int, optional
        Seed of the disguise; None: a random one.
    power_up : int
        Which of several power-ups in a log, from 1; 0: the only one, or that in which the range in UTC lies.
    """

    start: str | None = None
    end: str | None = None
    topics: tuple[str, ...] = ()
    anonymous: bool = False
    seed: int | None = None
    power_up: int = 0

    @property
    def span(self) -> str:
        """The range in words."""
        return f"{self.start or 'the start'} to {self.end or 'the end'}"

    def wants(self, topic: str) -> bool:
        """Tell whether a topic is to be kept.

        Examples
        --------
        >>> Wanted(topics=("ins*",)).wants("ins.2"), Wanted(topics=("ins",)).wants("ins.2"), Wanted().wants("x")
        (True, False, True)
        """
        return not self.topics or any(fnmatchcase(topic, pattern) for pattern in self.topics)


def clip(
    path: Path,
    target: Path,
    wanted: Wanted,
    *,
    configuration: Configuration | None = None,
    with_recording: bool = True,
    force: bool = False,
    listen: Listener = silent,
) -> Outcome:
    """Write a part of a flight to ``target`` (.mcap) and, beside it, its recording (.rrd).

    Device times, record indices and the clock's model stay as they are; the ledger is counted again. docs/compare.md
    describes ``clip.*`` of the metadata.

    Parameters
    ----------
    path : Path
        An MCAP that groundstation wrote, a log, or a flight folder.

    Raises
    ------
    UsageError
        When the part is empty or lies outside the flight, or a file is there already and ``force`` is not given.
    UnreadableLogError
        When the flight cannot be read, or nothing is left of the part.
    """
    settings = configuration or Configuration()
    limits = settings.thresholds
    source = file_in(path, ".mcap") if path.is_dir() else path
    _expect_free(source, target, with_recording, force)
    log = open_log(source, settings.profile_path, settings.icds)
    listen(Event("begin", total=1))
    listen(Event("stage", path.name, "cutting"))
    with told_in_a_line(str(target)):
        target.parent.mkdir(parents=True, exist_ok=True)
        with _as_mcap(log, target.parent, limits, wanted) as (log, mcap):
            done = _cut(log, mcap, target, wanted, limits)
    found: tuple[Failure, ...] = ()
    if with_recording:
        listen(Event("stage", path.name, "recording"))
        with gathered_failures():
            _record(target, done, settings)
            found = failures()
    recording = target.with_suffix(".rrd")
    sizes = [_size(target), *([f"recording {_size(recording)}"] if with_recording and recording.is_file() else [])]
    text = f"-> {target} ({', '.join((_told(done.info), *sizes))})"
    listen(Event("end", path.name, text))
    state: State = "incomplete" if found else "data_lost" if done.has_lost_data else "done"
    return Outcome(str(path), state, text, folder=str(target), failures=found)


def _expect_free(source: Path, target: Path, with_recording: bool, force: bool) -> None:
    """Refuse a target that is no .mcap, is the source, or would overwrite without ``force``."""
    if not source.exists():
        raise UsageError(str(source), "no such file or folder")
    if target.suffix != ".mcap" or target.is_dir():
        raise UsageError(str(target), "a folder" if target.is_dir() else "another name", "a file such as part.mcap")
    for file in (target, target.with_suffix(".rrd")) if with_recording else (target,):
        if file.exists() and (not force or file.resolve() == source.resolve()):
            raise UsageError(str(file), "a file that exists", "a new name", "-f overwrites it")


@contextmanager
def _as_mcap(log: Log, folder: Path, limits: Thresholds, wanted: Wanted) -> Iterator[tuple[Log, Path]]:
    """Yield the log and its MCAP: the log itself, or a temporary file.

    From several power-ups it takes the one wanted.
    """
    if log.is_store and not segments_in(log.info()):
        yield log, log.path
        return
    with tempfile.TemporaryDirectory(prefix=".partial-", dir=folder) as temporary:
        whole = Path(temporary) / "whole.mcap"
        found = convert_flight(log, whole, limits)
        if isinstance(found, tuple):
            log = _wanted_of(found, wanted)
            convert_log(log, whole, limits)
        yield log, whole


def _wanted_of(logs: Sequence[Log], wanted: Wanted) -> Log:
    """Return the power-up that is asked for by its number, or by a range in UTC."""
    segments = [log.segment for log in logs if log.segment is not None]
    numbers = [one.number for one in segments if wanted.power_up in (0, one.number) and _may_hold(one, wanted)]
    if len(numbers) == 1:
        return logs[numbers[0] - 1]
    found = f"{len(logs)} power-ups" if not wanted.power_up else f"no power-up {wanted.power_up} of {len(logs)}"
    raise UsageError(logs[0].path.name, found, "one of them", f"--power-up 1 to {len(logs)}")


def _may_hold(segment: Segment, wanted: Wanted) -> bool:
    """Tell whether a range given in UTC lies in a power-up; one in seconds may lie in any."""
    texts = [text for text in (wanted.start, wanted.end) if text is not None]
    if segment.shift_ns or not texts or not all("T" in text for text in texts):
        return True
    ends_ns = [iso_to_utc_ns(text)[0] for text in texts]
    start_ns = ends_ns[0] if wanted.start is not None else segment.start_ns
    end_ns = ends_ns[-1] if wanted.end is not None else segment.end_ns
    return start_ns <= segment.end_ns and end_ns > segment.start_ns


def _cut(log: Log, mcap: Path, target: Path, wanted: Wanted, limits: Thresholds) -> Converted:
    from groundstation.store.reader import StorePart, read, read_info
    from groundstation.store.writer import StoreWriter

    info = read_info(mcap)
    zero_ns = _zero_ns(mcap, info)
    start_ns, end_ns = _span_ns(wanted, zero_ns, info.has_utc)
    part = StorePart(start_ns, end_ns, wanted.wants)
    disguise = disguise_of(mcap, info, wanted.seed) if wanted.anonymous else None
    census, damages = census_of(info, limits), list[Damage]()
    first_ns: int | None = None
    with StoreWriter(target, info) as writer:
        zero: RecordBatch | None = None
        for item in read(mcap, part):
            if isinstance(item, RecordBatch):
                assert item.time_ns is not None
                time_ns = int(item.time_ns[0])
                shown = item if disguise is None else disguise.batch(item)
                if shown is None:
                    continue
                if first_ns is None:
                    zero = _zero_event(wanted, disguise, zero_ns, time_ns)
                    for event in () if zero is None else (zero,):
                        writer.write(event)
                        census.add(event)
                first_ns = time_ns if first_ns is None else min(first_ns, time_ns)
                writer.write(shown)
                census.add(shown)
            elif isinstance(item, Damage):
                damages.append(item if disguise is None else disguise.damage(item))
        if first_ns is None and damages:
            raise UnreadableLogError(log.path.name, f"no intact record from {wanted.span}", "", damages[0].what)
        if first_ns is None:
            raise _nothing_in(log, info, wanted)
        first_ns = first_ns if zero is None else zero_ns
        inside = _inside(info, zero_ns, first_ns, part)
        metadata = {**info.metadata, **_origin(log.source, info, zero_ns, first_ns, part, wanted)}
        # Without name and digest of the log: the part is a log of its own, and two parts of one log are not the same.
        # Without its own name: equal parts are equal to the byte under any name.
        cut = replace(inside, start_ns=first_ns, metadata=metadata)
        cut = cut if disguise is None else disguise.info(cut)
        cut = replace(cut, source_name="" if disguise is None else f"{ANONYMOUS}.mcap", source_sha256="")
        info = writer.info = recounted(cut, damages, census)
    return Converted(info, info.findings, any(entry.get("loses_data") for entry in info.damages))


def _zero_event(wanted: Wanted, disguise: Disguise | None, zero_ns: int, first_ns: int) -> RecordBatch | None:
    """Return an event at flight time zero, None where none is needed.

    It is needed where a topic that is left out may be what began at zero. Analyses count from flight time zero: without
    it their grid would begin elsewhere.
    """
    is_whole = disguise is not None and not wanted.topics
    if wanted.start or not (is_whole or (wanted.topics and first_ns > zero_ns)):
        return None
    return (disguise or Disguise(0)).zero(zero_ns)


def _zero_ns(mcap: Path, info: "StoreInfo") -> int:
    """Return the corrected time of flight time zero.

    Where the file lost it, that of the first record left.
    """
    from groundstation.store.reader import read

    if info.start_ns is not None:
        return info.start_ns
    times = (item.time_ns for item in read(mcap) if isinstance(item, RecordBatch))
    return min((int(time_ns[0]) for time_ns in times if time_ns is not None), default=0)


def _span_ns(wanted: Wanted, zero_ns: int, has_utc: bool) -> tuple[int, int]:
    ends = [-FARTHEST_S, FARTHEST_S + 1.0]
    for number, text in enumerate((wanted.start, wanted.end)):
        if text is not None:
            ends[number] = min(max(flight_seconds(text, zero_ns, has_utc), -FARTHEST_S), FARTHEST_S)
    if ends[1] <= ends[0]:
        raise SettingsError("range", wanted.span, "an end after its start")
    start_ns, end_ns = (zero_ns + round(seconds * NS_PER_S) for seconds in ends)
    return max(start_ns, 0), max(end_ns, 0)


def _nothing_in(log: Log, info: "StoreInfo", wanted: Wanted) -> UsageError:
    """Return the error of an empty part.

    No topic is wanted, or the flight has no record of them then.
    """
    topics = info.ledger.topics
    if topics and not any(wanted.wants(topic) for topic in topics):
        asked = ", ".join(map(repr, wanted.topics))
        return UsageError(log.path.name, f"no topic {asked}", f"some of {', '.join(topics)}")
    expected = ""
    if topics:
        first, last = (facts_of(log, {}, info.ledger)[f"{end} sample"] for end in ("first", "last"))
        expected = f"a part of {first} to {last}"
        if info.has_utc and info.start_ns is not None:
            expected += f", 0 to {flight_seconds(last, info.start_ns, True):.1f} s"
    return UsageError(log.path.name, f"no record from {wanted.span}", expected)


def _inside(info: "StoreInfo", zero_ns: int, first_ns: int, part: "StorePart") -> "StoreInfo":
    """Return the facts of the flight without those of places outside the part.

    Damaged spans, losses there, and findings on them. Losses without a known place in time stay: they may lie within.
    """
    spans = info.ledger.spans
    low_s, high_s = ((end_ns - zero_ns) / NS_PER_S for end_ns in (part.start_ns, part.end_ns))
    within = [one for one in spans if one.start_s < high_s and one.start_s + one.length_s >= low_s]
    outside = {_mark_of_span(one) for one in spans} - {_mark_of_span(one) for one in within}
    gone = [entry for entry in info.damages if _mark(entry) in outside]
    told = {(f"data.{entry.get('kind')}", entry.get("topic"), entry.get("place")) for entry in gone}
    shift_s = (first_ns - zero_ns) / NS_PER_S
    lost = {_mark(entry) for entry in gone}
    return replace(
        info,
        damages=[entry for entry in info.damages if entry not in gone],
        findings=tuple(one for one in info.findings if (one.code, one.topic, one.place) not in told),
        ledger=Ledger(
            spans=tuple(replace(one, start_s=round(one.start_s - shift_s, 3)) for one in within),
            damages=tuple(one for one in info.ledger.damages if (one.kind, one.topic, one.count) not in lost),
            remarks=info.ledger.remarks,
        ),
    )


def _mark(damage: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return what a loss and its span have in common: kind, topic, count."""
    return damage.get("kind"), damage.get("topic"), damage.get("count")


def _mark_of_span(span: DamagedSpan) -> tuple[Any, ...]:
    return span.cause, span.topic, span.count


def _origin(
    source: Source, info: "StoreInfo", zero_ns: int, first_ns: int, part: "StorePart", wanted: Wanted
) -> dict[str, str]:
    """Return the source that the part was cut from.

    A part of a part names the original flight.
    """
    name, sha256 = source.name, source.sha256
    base_s = 0.0
    if CUT_FROM in info.metadata:
        name, sha256 = info.metadata[CUT_FROM], info.metadata.get(CUT_SHA256, "")
        base_s = zero_s(info.metadata)
    ends_ns = {"clip.from": part.start_ns, "clip.to": part.end_ns}
    given = {"clip.from": wanted.start, "clip.to": wanted.end}
    ends = {key: (time_ns - zero_ns) / NS_PER_S + base_s for key, time_ns in ends_ns.items() if given[key] is not None}
    return {
        CUT_FROM: name,
        CUT_SHA256: sha256,
        ZERO: f"{(first_ns - zero_ns) / NS_PER_S + base_s:.9f}",
        **{f"{key}_s": f"{seconds:.9g}" for key, seconds in ends.items()},
        **{key: utc_ns_to_iso(ends_ns[key]) for key in ends if info.has_utc},
        **({"clip.topics": " ".join(wanted.topics)} if wanted.topics else {}),
    }


def zero_s(metadata: Mapping[str, Any]) -> float:
    """Return the flight time at which a part begins, in the flight it was cut from, s.

    0 for a whole flight.

    Examples
    --------
    >>> zero_s({"clip.zero_s": "62.5"}), zero_s({}), zero_s({"clip.zero_s": "?"})
    (62.5, 0.0, 0.0)
    """
    try:
        return flight_seconds(str(metadata.get(ZERO, "0")), 0, False)
    except SettingsError:
        return 0.0


def _record(target: Path, done: Converted, configuration: Configuration) -> None:
    """Write the recording of a part, with everything that its data allows."""
    from groundstation.systems import systems
    from groundstation.viewer.recording import write_recording

    log = open_log(target)
    flight = read_flight(target, done)
    identity = flight_id(flight.start_ns if flight.has_utc else None, flight.metadata, log.source.sha256)
    results = analyse(flight, given_of(log, done, identity), configuration)
    attempt(
        "recording",
        "part",
        write_recording,
        target.with_suffix(".rrd"),
        flight,
        results,
        systems(),
        unless=OF_THE_WORLD,
    )


def _told(info: "StoreInfo") -> str:
    topics = info.ledger.topics
    rows = sum(topic.rows for topic in topics.values())
    ends = [info.metadata.get(key) for key in ("clip.from_s", "clip.to_s")]
    start, end = (f"{float(text):.3f} s" if text else word for text, word in zip(ends, ("start", "end"), strict=True))
    origin = info.metadata.get(CUT_FROM, "a flight made anonymous")
    return (
        f"{counted(rows, 'record')} of {counted(len(topics), 'topic')}, {start} to {end} of {origin}, {_length(info)}"
    )


def _length(info: "StoreInfo") -> str:
    """Return how long a part is, by the topic that lasts longest."""
    return f"{max((topic.span_s for topic in info.ledger.topics.values()), default=0.0):.1f} s long"


def _size(file: Path) -> str:
    return f"{file.stat().st_size / 1e6:.2f} MB"
