"""Batch of a watch, in a process of its own.

So a watch of weeks keeps no thread and no memory of what it ran.
"""

import math
import multiprocessing
import os
import signal
import threading
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnclaimedLogError
from groundstation.base.without_pandas import spare_pandas
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener

if TYPE_CHECKING:
    from groundstation.reports.index import IndexRow

_CONTEXT = multiprocessing.get_context("spawn")
END_S = 20.0  # for a batch that is interrupted to write its index


@dataclass(frozen=True)
class WatchedLogs:
    """Logs to run; the fields are the parameters of ``run_many``.

    ``is_first``: the index then lists the logs without a flight of this batch alone, as that of ``run`` does; later
    those of earlier batches stay.
    """

    paths: tuple[Path, ...]
    out: Path
    configuration: Configuration
    fail_on: str
    with_pdf: bool
    jobs: int
    stations: Path | None
    force: bool
    is_first: bool
    only_results: bool = False
    timeout_s: float = math.inf
    is_isolated: bool = False


def run_batch(batch: WatchedLogs, listen: Listener) -> tuple[Outcome, ...] | str:
    """Run a batch in a process of its own.

    Returns what became of its logs, or why nothing was run.

    Where that process dies (killed, or out of memory) its logs are run one by one: the one with which it dies again
    has failed. Interrupted, the process writes the index of what is finished, and ends.
    """
    receiver, sender = _CONTEXT.Pipe(duplex=False)
    process = _CONTEXT.Process(target=_run, args=(sender, batch), name="batch")
    process.start()
    sender.close()
    try:
        while True:
            message: Any = receiver.recv()
            if not isinstance(message, Event):
                process.join()
                return message  # type: ignore[no-any-return]
            listen(message)
    except EOFError:
        process.join()
    except BaseException:
        process.terminate()
        process.join(END_S)
        process.kill()
        raise
    finally:
        receiver.close()
    if len(batch.paths) > 1:
        return _one_by_one(batch, listen)
    (path,) = batch.paths
    return (Outcome(str(path), "failed", f"{path.name}: its process died (killed, or out of memory)"),)


def _one_by_one(batch: WatchedLogs, listen: Listener) -> tuple[Outcome, ...] | str:
    outcomes: list[Outcome] = []
    for path in batch.paths:
        found = run_batch(replace(batch, paths=(path,), is_first=False), listen)
        if isinstance(found, str):
            return found
        outcomes += found
    return tuple(outcomes)


def _run(sender: Connection, batch: WatchedLogs) -> None:
    """Run a batch in the process made for it.

    It ends with the watch, and cleanly when it is asked to.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the watch is interrupted, and ends this process in its way
    signal.signal(signal.SIGTERM, _interrupted)
    threading.Thread(target=_end_with_the_watch, name="parent", daemon=True).start()
    lock = threading.Lock()  # events come from several threads
    spare_pandas()

    def send(message: object) -> None:
        with lock, suppress(OSError):
            sender.send(message)

    with suppress(KeyboardInterrupt):
        try:
            send(_outcomes(batch, send))
        except Exception as error:  # a folder that cannot be written, another run in it
            send(reason_of(str(batch.out), error)[0])


def _interrupted(_signal: int, _frame: object) -> NoReturn:
    raise KeyboardInterrupt


def _end_with_the_watch() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for([parent.sentinel])
        os._exit(1)


def _outcomes(batch: WatchedLogs, listen: Listener) -> tuple[Outcome, ...]:
    from groundstation.pipeline.many_flights.fleet.index import rows_without_flight
    from groundstation.pipeline.many_flights.runs.batch import run_many

    strangers = [one for path in batch.paths if (one := _unclaimed(path, batch)) is not None]
    claimed = sorted({*map(str, batch.paths)} - {one.source for one in strangers})
    before = [] if batch.is_first else rows_without_flight(batch.out)
    outcomes: tuple[Outcome, ...] = ()
    if claimed or (strangers and _has_flights(batch.out)):  # a file that cannot be read alone may be part of a flight
        outcomes = run_many(
            claimed,
            batch.out,
            batch.configuration,
            unclaimed=[Path(one.source) for one in strangers],
            jobs=batch.jobs,
            only_results=batch.only_results,
            timeout_s=batch.timeout_s,
            is_isolated=batch.is_isolated,
            force=batch.force,
            fail_on=batch.fail_on,
            with_pdf=batch.with_pdf,
            stations=batch.stations,
            listen=listen,
        )
    joined = {one.source for one in outcomes}
    strangers = [one for one in strangers if one.source not in joined]
    _list_too(batch, before, strangers)
    return (*strangers, *outcomes)


def _has_flights(out: Path) -> bool:
    """Tell whether any flight is in a folder of results."""
    from groundstation.pipeline.many_flights.inputs import flight_folders

    return out.is_dir() and bool(flight_folders(out))


def _unclaimed(path: Path, batch: WatchedLogs) -> Outcome | None:
    """Outcome of a file that no reader claims, which in a folder is skipped.

    None for any other.

    Isolated, only its first bytes are looked at: nothing of it is decompressed or read in this process.
    """
    from groundstation.readers.registry import identify, unclaimed
    from groundstation.store.recognition import is_groundstation_mcap

    try:
        if is_groundstation_mcap(path):
            return None
        if not batch.is_isolated:
            identify(path, batch.configuration.profile_path)
        elif batch.configuration.profile is None and (error := unclaimed(path)) is not None:
            raise error
    except UnclaimedLogError as error:
        return Outcome(str(path), "skipped", str(error))
    except (GroundstationError, OSError):  # told when it is run
        return None
    return None


def _list_too(batch: WatchedLogs, before: "list[IndexRow]", strangers: list[Outcome]) -> None:
    """List the logs without a flight of earlier batches, and the files that no reader claims."""
    from groundstation.pipeline.many_flights.fleet.index import rows_without_flight, write_index_of
    from groundstation.pipeline.many_flights.runs.out_folder import alone_in

    now = {str(path) for path in batch.paths}
    kept = [row for row in before if row.source not in now]
    if batch.out.is_dir() and (kept or strangers):
        with alone_in(batch.out):
            listed = rows_without_flight(batch.out)
            told = {row.source for row in listed}
            write_index_of(batch.out, strangers, [*listed, *(row for row in kept if row.source not in told)])
