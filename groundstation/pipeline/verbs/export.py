"""Verb ``export``: the tracks of a flight in a format that the file's suffix chooses.

Formats are those of other programs.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from groundstation.base.errors import NotAssessableError, UsageError, told_in_a_line
from groundstation.base.records import Damage, RecordBatch
from groundstation.exports.tracks import Track, tracks_of
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK, file_in, no_log
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import as_log, open_log
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.readers.sbet import accuracies_beside
from groundstation.tables.table import Flight

if TYPE_CHECKING:
    from groundstation.results.files import SavedFlight


def export(
    path: Path,
    target: Path,
    *,
    names: Sequence[str] = (),
    configuration: Configuration | None = None,
    force: bool = False,
) -> Outcome:
    """Write tracks of a flight to ``target`` in the format of its suffix.

    .kml, .gpx, .csv, .parquet, .nmea, .sbet or .out (SBET). The sigmas of a track are written beside an SBET whose name
    begins with ``sbet``, as ``smrmsg``.

    Parameters
    ----------
    path : Path
        A flight folder, an MCAP or a log. The tracks of the estimators are in a folder alone.
    names : sequence of str
        Tracks wanted: topics, ``corrected``, ``smoothed`` ...; none: all, or the first that the format can hold, in an
        SBET the best trajectory before the logged tracks.

    Raises
    ------
    UsageError
        For another suffix, a track that the flight lacks, several where one is written, or a file that is there.
    NotAssessableError
        When the flight has no track, or the format needs what it lacks.
    """
    suffix = target.suffix.lower()
    require_suffix(target, (*WRITERS, *WRITERS_OF_ONE))
    require_place(path, target, force)
    beside = accuracies_beside(target) if WRITERS_OF_ONE.get(suffix) is _sbet else None
    if beside is not None:
        require_place(path, beside, force)
    flight, saved, has_lost = _read(path, configuration or Configuration())
    tracks = _wanted(tracks_of(flight, None if saved is None else saved.results), names, path.name)
    if WRITERS_OF_ONE.get(suffix) is _sbet:
        tracks = tuple(sorted(tracks, key=lambda track: not track.is_best))
    with told_in_a_line(str(target)):
        target.parent.mkdir(parents=True, exist_ok=True)
        if suffix in WRITERS:
            WRITERS[suffix](target, flight.source_name, tracks)
            told = ", ".join(f"{track.name} ({len(track)})" for track in tracks)
        else:
            told = _written_alone(WRITERS_OF_ONE[suffix], target, tracks, bool(names))
    return Outcome(str(path), "data_lost" if has_lost else "done", f"-> {target}: {told}", folder=str(target))


def require_suffix(target: Path, suffixes: Sequence[str]) -> None:
    """Refuse a file of another kind.

    Raises
    ------
    UsageError
    """
    if target.suffix.lower() not in suffixes:
        raise UsageError(str(target), f"suffix {target.suffix or 'none'}", f"one of {', '.join(suffixes)}")


def require_place(source: Path, target: Path, force: bool) -> None:
    """Refuse a source that does not exist, and a target that does.

    With ``force`` a target may exist, unless it is the source.

    Raises
    ------
    UsageError
    """
    if not source.exists():
        raise UsageError(str(source), "no such file or folder")
    if target.is_dir() or (target.exists() and (not force or target.resolve() == source.resolve())):
        raise UsageError(str(target), "a file that exists", "a new name", "-f overwrites it")


def _read(path: Path, configuration: Configuration) -> "tuple[Flight, SavedFlight | None, bool]":
    """Return tables of a flight, its saved results, and whether data were lost on the way."""
    from groundstation.store.reader import read, read_info
    from groundstation.tables.assemble import flight_from_batches

    saved = None
    log_path = as_log(path)
    if log_path.is_dir():
        saved, log_path = saved_flight(path), file_in(path, ".mcap")
    log = open_log(log_path, configuration.profile_path, configuration.icds)
    with told_in_a_line(log_path.name), TemporaryDirectory(prefix="groundstation-") as folder:
        mcap, has_lost = log.path, False
        if not log.is_store:
            mcap = Path(folder) / "flight.mcap"
            has_lost = convert_log(log, mcap, configuration.thresholds).has_lost_data
        info, items = read_info(mcap), list(read(mcap))
    batches = (item for item in items if isinstance(item, RecordBatch))
    has_lost |= any(isinstance(item, Damage) and item.loses_data for item in items)
    flight = flight_from_batches(
        batches, metadata=info.metadata, has_utc=info.has_utc, source_name=info.source_name, rows=info.ledger.rows
    )
    return flight, saved, has_lost


def saved_flight(folder: Path) -> "SavedFlight":
    """Return the saved results of a flight.

    Raises
    ------
    UsageError
        When it is no folder of a flight.
    """
    from groundstation.results.files import load
    from groundstation.systems import systems

    if not (folder / FLIGHT_FOLDER_MARK).is_file():
        raise no_log(folder, takes_flights=True)
    return load(folder, systems().answer_types)


def _wanted(tracks: tuple[Track, ...], names: Sequence[str], source: str) -> tuple[Track, ...]:
    if not tracks:
        raise NotAssessableError(source, "no positions", "a log with positions of a receiver or an INS")
    by_name = {track.name: track for track in tracks}
    for name in names:
        if name not in by_name:
            raise UsageError(f"track {name}", f"not in {source}", f"one of {', '.join(by_name)}")
    return tuple(by_name[name] for name in dict.fromkeys(names)) if names else tracks


def _written_alone(write: Callable[[Path, Track], int], target: Path, tracks: tuple[Track, ...], is_named: bool) -> str:
    """Write the one track of a format, and return what was written in words.

    The one named, else the first that has what the format needs.
    """
    if is_named and len(tracks) > 1:
        raise UsageError(str(target), f"{len(tracks)} tracks", "one", "name one --track")
    reasons = []
    for track in tracks:
        try:
            left_out = write(target, track)
            lacking = f", {left_out} left out: they lack what the format needs" if left_out else ""
            return f"{track.name} ({len(track) - left_out}{lacking})"
        except NotAssessableError as error:
            reasons.append(error)
    raise reasons[-1]


def _kml(path: Path, title: str, tracks: Sequence[Track]) -> None:
    from groundstation.exports.kml import write_kml

    write_kml(path, title, tracks)


def _gpx(path: Path, title: str, tracks: Sequence[Track]) -> None:
    from groundstation.exports.gpx import write_gpx

    write_gpx(path, title, tracks)


def _csv(path: Path, _title: str, tracks: Sequence[Track]) -> None:
    from groundstation.exports.table import write_csv

    write_csv(path, tracks)


def _parquet(path: Path, _title: str, tracks: Sequence[Track]) -> None:
    from groundstation.exports.table import write_parquet

    write_parquet(path, tracks)


def _nmea(path: Path, track: Track) -> int:
    from groundstation.exports.nmea import write_nmea

    write_nmea(path, track)
    return 0


def _sbet(path: Path, track: Track) -> int:
    from groundstation.exports.sbet import write_accuracies, write_sbet

    left_out = write_sbet(path, track)
    beside = accuracies_beside(path)
    if beside is not None and not write_accuracies(beside, track):
        beside.unlink(missing_ok=True)  # those of an SBET that was overwritten
    return left_out


WRITERS: Mapping[str, Callable[[Path, str, Sequence[Track]], None]] = {
    ".kml": _kml,
    ".gpx": _gpx,
    ".csv": _csv,
    ".parquet": _parquet,
}
WRITERS_OF_ONE: Mapping[str, Callable[[Path, Track], int]] = {".nmea": _nmea, ".sbet": _sbet, ".out": _sbet}
