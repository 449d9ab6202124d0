"""The fleet of 100 000 flights: leading process, one flight added, report, recording; with synthetic results.

``python -m benchmarks.bench_fleet_store [FLIGHTS [months]]`` records the figures; with ``months`` there is the dataset
alone, without flight folders.
"""

import multiprocessing
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from benchmarks.record import Book
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.fleet.index import write_index_of
from groundstation.pipeline.many_flights.fleet.keys import FlightKeys, Key, month_of
from groundstation.pipeline.many_flights.fleet.refresh import put_month, refresh
from groundstation.pipeline.many_flights.fleet.rows import share_of
from groundstation.pipeline.many_flights.fleet.samples import SAMPLES
from groundstation.pipeline.many_flights.fleet.scan import Scan, remembered, scan, stamp_of
from groundstation.pipeline.many_flights.fleet.statistics import write_fleet
from groundstation.pipeline.many_flights.fleet.table import to_arrow
from groundstation.pipeline.many_flights.runs.destination import Destination, LocalOutput
from groundstation.pipeline.many_flights.runs.known_flights import KnownFlights
from groundstation.pipeline.many_flights.runs.out_folder import clear_unfinished, prepare, refuse_foreign
from groundstation.pipeline.many_flights.sessions.search import members_of
from groundstation.reports.fleet_report import write_fleet_report
from groundstation.results.file_names import ARRAYS, MANIFEST, SUMMARY
from groundstation.systems import systems
from groundstation.viewer.fleet import write_fleet_recording
from tests.fleet_example import save_flight, skill

FLIGHTS, AIRCRAFT, DAYS = 100_000, 50, 730
START = datetime(2024, 1, 1, 6, tzinfo=UTC)
TEMPLATES = 20  # flights saved whole; the others are copies by link, with other names and figures in the dataset alone


def identity_of(number: int, flights: int) -> str:
    """Flight id of a flight, all of them spread over the days."""
    start = START + timedelta(seconds=number * DAYS * 86_400 // flights)
    return f"{start:%Y%m%dT%H%M%SZ}_A{number % AIRCRAFT:02d}_{number}"


def make_flight(out: Path, identity: str, template: Path) -> None:
    """Put a flight folder: the files of a template, linked."""
    (out / identity / ARRAYS).mkdir(parents=True)
    for name in (SUMMARY, MANIFEST, f"{ARRAYS}/heading_samples.parquet"):
        os.link(template / name, out / identity / name)


def samples_of(identity: str, number: int) -> str:
    """File of the heading samples of a flight, in the dataset of samples."""
    return f"aircraft=A{number % AIRCRAFT:02d}/month={month_of(identity)}/{identity}.parquet"


def make_samples(out: Path, files: list[str], sample: Path) -> None:
    """Put the samples of flights, linked to as few files as the file system allows."""
    for number, name in enumerate(files):
        kept = out.parent / f"sample{number % TEMPLATES}.parquet"
        if not kept.exists():
            shutil.copy(sample, kept)
        (out / SAMPLES / name).parent.mkdir(parents=True, exist_ok=True)
        os.link(kept, out / SAMPLES / name)


def make_fleet(out: Path, templates: list[Path], flights: int, with_folders: bool) -> None:
    """Make a folder of flights, and what workers put into the dataset of them, as if they had read them."""
    shares = to_arrow([share_of(template) for template in templates])
    rng, sample = np.random.default_rng(7), next((out.parent / SAMPLES).rglob("*.parquet"))
    months: dict[str, list[int]] = {}
    for number in range(flights):
        months.setdefault(month_of(identity_of(number, flights)), []).append(number)
    for month, numbers in months.items():
        names = [identity_of(number, flights) for number in numbers]
        for number, name in zip(numbers if with_folders else (), names, strict=False):
            make_flight(out, name, templates[number % TEMPLATES])
        files = [samples_of(name, number) if with_folders else "" for number, name in zip(numbers, names, strict=True)]
        if with_folders:
            make_samples(out, files, sample)
        table = shares.take(np.array(numbers) % TEMPLATES)
        number = np.array(numbers)
        starts = [int(datetime.strptime(one[:16], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC).timestamp()) for one in names]
        own = {
            "flight_id": names,
            "aircraft": [f"A{one % AIRCRAFT:02d}" for one in numbers],
            "start_utc": np.array(starts) * NS_PER_S,
            "month": [month] * len(names),
            "error_deg": np.round(rng.normal(0.02 * (number % AIRCRAFT), 0.2), 4),
            "sha256": [f"{one:064x}" for one in numbers],
        }
        for key, values in own.items():
            place = table.schema.get_field_index(key)
            kind = table.schema.field(key).type
            array = pa.array(values)
            array = array.dictionary_encode() if pa.types.is_dictionary(kind) else array.cast(kind)
            table = table.set_column(place, key, array)
        keys = [
            Key(name, stamp_of(out, name) or 0, f"/logs/{one}.ulg", f"{one:064x}", "", "", start * NS_PER_S, None, file)
            for one, name, start, file in zip(numbers, names, starts, files, strict=True)
        ]
        put_month(out, month, table, FlightKeys.of(keys))


def timed(book: Book, what: str, work: Callable[[], Any]) -> Any:
    """Do something; record its seconds, by the clock and of this process, and the largest this process has been."""
    began, worked = time.perf_counter(), time.process_time()
    found = work()
    seconds, busy_s = time.perf_counter() - began, time.process_time() - worked
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    book.figure(what, seconds, "s by the clock", note=f"{busy_s:.1f} s of processor time; up to here {peak_gb:.2f} GB")
    return found


def one_more(out: Path, identity: str) -> None:
    """What a run does beside the flight itself when it adds one."""
    refuse_foreign(out, force=False)
    prepare(out)
    KnownFlights(out)
    clear_unfinished(out)
    found, problems = refresh(out)
    Destination(LocalOutput(out), []).sweep(found)
    members_of(found, {identity})
    assert not problems and not found.stale
    write_index_of(out, (), (), found)


def main() -> None:
    """Measure and record."""
    flights = int(sys.argv[1]) if len(sys.argv) > 1 else FLIGHTS
    with_folders = sys.argv[2:] != ["months"]
    with Book("fleet_store") as book, tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        out.mkdir()
        templates = [
            save_flight(Path(folder), number, samples=1600, forecast=skill((1.0, 5.0, 10.0, 30.0, 60.0, 90.0)))
            for number in range(TEMPLATES)
        ]
        timed(book, f"{TEMPLATES} flights read by a worker", lambda: refresh(Path(folder)))
        arguments = (out, templates, flights, with_folders)
        maker = multiprocessing.get_context("spawn").Process(target=make_fleet, args=arguments)
        maker.start()  # its memory is not that of the process that leads a run
        maker.join()
        if with_folders:
            one_flight(book, out, templates, flights)
            found = scan(out)
        else:
            keys = timed(book, "keys", lambda: remembered(out))
            found = Scan(out, keys, (), (), {})
        assert len(found) == len(found.fresh) == flights
        together(book, out, found)


def one_flight(book: Book, out: Path, templates: list[Path], flights: int) -> None:
    """What a run does when a flight is gone, and when one comes."""
    last = identity_of(flights - 1, flights)
    write_index_of(out, ())
    shutil.rmtree(out / last)
    timed(book, "one flight gone", lambda: one_more(out, last))
    (out / last).mkdir()
    shutil.copytree(templates[0], out / last, dirs_exist_ok=True)
    timed(book, "one flight added", lambda: one_more(out, last))


def together(book: Book, out: Path, found: Scan) -> None:
    """What a run, ``report`` and users do with all flights."""
    fleet, _problems = timed(book, "fleet put together", lambda: write_fleet(out, found))
    timed(book, "summary.html", lambda: write_fleet_report(out, fleet, systems(), with_pdf=False))
    timed(book, "fleet.rrd", lambda: write_fleet_recording(out / "fleet.rrd", fleet, systems()))
    for name in ("summary.html", "fleet.rrd"):
        book.figure(f"{name} written", (out / name).stat().st_size / 1e6, "MB")
    files = list((out / "flights.parquet").iterdir())
    size_mb = sum(one.stat().st_size for one in files) / 1e6
    book.figure("flights.parquet written", size_mb, "MB", note=f"{len(files)} files")
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(out / "fleet.rrd")]
    checked = subprocess.run(command, check=False, capture_output=True)
    print(f"rerun rrd verify: {'passed' if checked.returncode == 0 else checked.stderr.decode()[-300:]}")


if __name__ == "__main__":
    main()
