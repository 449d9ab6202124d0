"""Registry of the readers: find the one for a file by its content.

Built-in readers are listed here; third parties add theirs through entry points of the group
``groundstation.readers``: a module or object with ``NAME``, ``sniff(source)`` and ``read(source)``. A plug-in that
fails never hides the others.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnclaimedLogError, UnreadableLogError
from groundstation.base.plug_ins import load_plug_ins
from groundstation.base.records import Item, RecordBatch, Remark
from groundstation.readers import bags, chapter10, dataflash, flightdata_hdf5, igc, magic, receiver, sbet, tlog, ulog
from groundstation.readers.compressed import COMPRESSIONS, compression_of
from groundstation.readers.profile_sources import READER as OF_PROFILES
from groundstation.readers.profile_sources import known_profiles, other_profiles
from groundstation.readers.source import Claim, Reader, Source

if TYPE_CHECKING:
    from groundstation.readers.icd import Icd

ENTRY_POINT_GROUP = "groundstation.readers"
_BINARY: tuple[Reader, ...] = (chapter10, dataflash, ulog, flightdata_hdf5, receiver, sbet, bags, tlog, igc)
_TABLES = ("flysight2", OF_PROFILES, "flat-csv", "rtklib-pos")  # names of the readers of tables


@cache
def _readers_of_tables() -> tuple[Reader, ...]:
    """Readers of tables, loaded where a file may be one.

    They would be half of what reading a binary log imports.
    """
    from groundstation.readers import csv_profile, flat_csv, flysight2, rtklib_pos

    return flysight2, csv_profile, flat_csv, rtklib_pos


def _built_in() -> tuple[Reader, ...]:
    return (*_BINARY, *_readers_of_tables())


@dataclass(frozen=True)
class Format:
    """Readable format: the reader's name, one line on it, and the reader's origin."""

    name: str
    summary: str
    origin: str


@cache
def _plug_ins() -> tuple[dict[str, Reader], tuple[str, ...]]:
    """Third-party readers by name, and one line for each plug-in that cannot be used."""
    readers: dict[str, Reader] = {}
    taken = {*(reader.NAME for reader in _BINARY), *_TABLES}

    def take(reader: Any) -> str:
        name = str(reader.NAME)
        if not (callable(reader.sniff) and callable(reader.read)):
            raise TypeError("sniff and read must be functions")
        if name in taken | readers.keys():
            return f"{name!r} is taken"
        readers[name] = reader
        return ""

    failures = load_plug_ins(ENTRY_POINT_GROUP, "reader", take)
    return readers, (*failures, *other_profiles().failures)


def _named(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _reader(name: str) -> Reader:
    found = next((reader for reader in _BINARY if name == reader.NAME), None) or _plug_ins()[0].get(name)
    return found or next(reader for reader in _readers_of_tables() if name == reader.NAME)


def plug_in_failures() -> tuple[str, ...]:
    """List one line for each third-party reader that could not be loaded."""
    return _plug_ins()[1]


def formats() -> tuple[Format, ...]:
    """Formats that can be read, built-in ones first."""
    built_in = [Format(reader.NAME, _summary(reader), "built in") for reader in _built_in()]
    added = [Format(name, _summary(reader), "plug-in") for name, reader in _plug_ins()[0].items()]
    return (*built_in, *added)


def _summary(reader: Reader) -> str:
    return next(iter((reader.__doc__ or "").strip().splitlines()), "")


def identify(path: str | Path | Source, profile: Path | None = None) -> Claim:
    """Find out which reader claims a file.

    Parameters
    ----------
    path : path of the log, or a :class:`Source`, which remembers the claim
    profile : path of a profile (TOML), optional
        With it, the file is a table of that layout whatever it looks like; of a bag it explains messages.

    Raises
    ------
    UnreadableLogError
        When the file is empty, of a known format that is not read in this version, or unknown.
    SettingsError
        When the profile cannot be used.
    """
    return _claim(_source_of(path), profile)[0]


def read(path: str | Path | Source, profile: Path | None = None, icds: "Sequence[Icd]" = ()) -> Iterator[Item]:
    """Iterate over the items of a file, with the reader that claims it.

    Raises at once as :func:`identify` does, not at the first item. Parameters as there; a :class:`Source` that is read
    again is not decompressed and not asked about again. ``icds`` name the bus words of a recording that has any.
    """
    source = _source_of(path)
    claim, troubles = _claim(source, profile)
    reader = _reader(claim.reader)
    if reader is bags:
        items = bags.read(source, profile)
    elif claim.reader == OF_PROFILES:
        items = _by_profile(source, profile)
    elif reader is chapter10:
        items = chapter10.read(source, icds)
    else:
        items = _guarded(reader, claim, source) if claim.reader in _plug_ins()[0] else reader.read(source)
    unused = [Remark("icd_of_another", "the ICD is not used: the log holds no bus words")]
    remarks = [
        *(Remark("plug_in", trouble) for trouble in troubles),
        *(unused if icds and reader is not chapter10 else []),
    ]
    return chain(_in_silence(iter(items)), _of_the_source(source), remarks)


def _by_profile(source: Source, profile: Path | None) -> Iterator[Item]:
    from groundstation.readers import csv_profile

    return csv_profile.read(source, profile)


def _in_silence(items: Iterator[Item]) -> Iterator[Item]:
    """Yield the items of a reader without numpy's warnings.

    A log may hold any number; the ledger flags odd ones.
    """
    while True:
        with np.errstate(all="ignore"):
            item = next(items, None)
        if item is None:
            return
        yield item


def _of_the_source(source: Source) -> Iterator[Item]:
    """Yield the damage of the compressed file, which is known when all was read."""
    yield from source.damages()


def _guarded(reader: Reader, claim: Claim, source: Source) -> Iterator[Item]:
    """Yield the items of a third-party reader; whatever it raises becomes one line."""
    try:
        yield from reader.read(source)
    except GroundstationError:
        raise
    except Exception as error:
        raise UnreadableLogError(source.name, f"reader {claim.reader!r} failed ({_named(error)})") from error


def _source_of(path: str | Path | Source) -> Source:
    return path if isinstance(path, Source) else Source(Path(path))


def _claim(source: Source, profile: Path | None) -> tuple[Claim, tuple[str, ...]]:
    """Return the claim on a source, found once, and troubles with plug-ins."""
    key = _claim, profile
    if key not in source.seen:
        source.seen[key] = _new_claim(source, profile)
    found: tuple[Claim, tuple[str, ...]] = source.seen[key]
    return found


@np.errstate(all="ignore")  # the first bytes of a file, taken for numbers, may be any
def _new_claim(source: Source, profile: Path | None) -> tuple[Claim, tuple[str, ...]]:
    if source.is_empty or magic.companion(source) is not None:
        raise _unclaimed(source, [], [])
    if profile is not None:
        if magic.is_archive(source):
            raise _unclaimed(source, [], [])
        return _claim_by(source, profile), plug_in_failures()
    claims, refusals, troubles = _claims(source)
    if claims:
        return _best(claims, source), tuple(troubles)
    raise _unclaimed(source, refusals, troubles)


def _claim_by(source: Source, profile: Path) -> Claim:
    if bags.sniff(source):
        return bags.claim_by(source, profile)
    from groundstation.readers import csv_profile

    return csv_profile.claim_by(source, profile)


@np.errstate(all="ignore")
def unclaimed(path: Path) -> UnclaimedLogError | None:
    """Return the reason why no reader claims a file, judged by its first bytes alone.

    None where the first bytes do not show it.

    Nothing is decompressed, and no plug-in is asked: where there is one, only :func:`identify` tells.
    """
    source = Source(path)
    try:
        with path.open("rb") as stream:
            is_packed = bool(compression_of(stream.read(4)))
        if is_packed or _plug_ins()[0]:
            return None
        is_none = source.is_empty or magic.companion(source) is not None
        claims, refusals, troubles = ([], [], []) if is_none else _claims(source)
        error = None if claims else _unclaimed(source, refusals, troubles, with_advice=False)
    except OSError:
        return None
    return error if isinstance(error, UnclaimedLogError) else None


def _claims(source: Source) -> tuple[list[Claim], list[GroundstationError], list[str]]:
    """Return the claims on a file, the refusals, and troubles with plug-ins."""
    claims: list[Claim] = []
    refusals: list[GroundstationError] = []
    troubles = list(plug_in_failures())
    for name, reader in _to_ask(claims, source):
        try:
            claim = _own(reader.sniff(source), name)
        except GroundstationError as error:
            refusals.append(error)
        except Exception as error:  # see _plug_ins; a built-in reader must not raise this
            if name not in _plug_ins()[0]:
                raise
            troubles.append(_one_line(f"reader plug-in {name!r} failed to look at the file: {_named(error)}"))
        else:
            claims += [claim] if claim is not None else []
    return claims, refusals, troubles


def _to_ask(claims: list[Claim], source: Source) -> Iterator[tuple[str, Reader]]:
    """Yield the readers to ask, those of tables while the claims leave a doubt."""
    is_archive = magic.is_archive(source)  # others may unpack it
    if not is_archive:
        yield from ((reader.NAME, reader) for reader in _BINARY)
    if not is_archive and not _are_sure(claims, source):
        for reader in _readers_of_tables():
            if not _are_sure(claims, source):
                yield reader.NAME, reader
    yield from _plug_ins()[0].items()


def _are_sure(claims: list[Claim], source: Source) -> bool:
    """Tell whether the claims make a search for rows needless.

    They do when a table is claimed, or a format by its first bytes and no text follows.
    """
    if any(claim.reader == OF_PROFILES for claim in claims):
        return True
    return any(claim.confidence == 1.0 for claim in claims) and not magic.is_mostly_text(source)


def _best(claims: list[Claim], source: Source) -> Claim:
    """Choose the claim that the content supports.

    Several claims arise where the beginning of another log stands in the file or before it.

    In what is mostly text the built-in readers of binary logs come last, in all else those of tables. A reader of
    binary logs that finds no record gives way.
    """
    if len(claims) == 1:
        return claims[0]
    binary = {reader.NAME for reader in _BINARY}
    late = binary if magic.is_mostly_text(source) else set(_TABLES)
    ranked = sorted(claims, key=lambda claim: (claim.reader in late, -claim.confidence, claim.reader))
    return next((one for one in ranked if one.reader not in binary or _has_records(one, source)), ranked[0])


def _has_records(claim: Claim, source: Source) -> bool:
    """Tell whether a built-in reader finds any record."""
    try:
        return any(isinstance(item, RecordBatch) for item in _reader(claim.reader).read(source))
    except GroundstationError:
        return False


def _own(claim: Any, name: str) -> Claim | None:
    """Return a reader's answer as our own claim."""
    if claim is None:
        return None
    return Claim(name, str(claim.detail), float(claim.confidence))


def _unclaimed(
    source: Source, refusals: list[GroundstationError], troubles: list[str], *, with_advice: bool = True
) -> GroundstationError:
    """Return why no reader claims a file; advice on a table takes a look at its rows."""
    if source.is_empty:
        return UnclaimedLogError(source.name, "an empty file", "a recorded log", "check how it was copied")
    companion = magic.companion(source)
    if companion is not None:
        return UnclaimedLogError(source.name, companion, "", "give the log itself")
    from groundstation.readers.flat_csv import PAGE

    flat_csv = f"the flat CSV ({PAGE})"
    known = magic.recognise(source)
    if known in COMPRESSIONS and not source.compression:
        return UnclaimedLogError(source.name, f"{known} data that cannot be decompressed")
    if known is not None:
        found = f"recognised as {known}, not readable in this version"
        return UnclaimedLogError(source.name, found, "", magic.UNPACK.get(known, f"convert it to {flat_csv}"))
    if refusals:
        return refusals[0]
    if with_advice and not magic.is_binary(source):
        from groundstation.readers.drafts.nearest import advice_on

        advice = advice_on(source, known_profiles(), PAGE)
        if advice is not None:
            more = f" ({'; '.join(troubles)})" if troubles else ""
            return UnclaimedLogError(source.name, advice.found + more, "", advice.next_step)
    if magic.is_wide_text(source):
        return UnclaimedLogError(source.name, "UTF-16 text without its mark", "UTF-8", "save it as CSV in UTF-8")
    found = "binary data of an unknown format" if magic.is_binary(source) else "text that no reader claims"
    names = ", ".join((*(reader.NAME for reader in _built_in()), *_plug_ins()[0]))
    found += f" ({'; '.join(troubles)})" if troubles else ""
    next_step = f"write {flat_csv}, or describe a table by a profile (--profile FILE)"
    return UnclaimedLogError(source.name, found, f"one of {names}", next_step)
