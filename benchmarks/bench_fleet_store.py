"""The fleet of 100 000 flights: leading process, one flight added, report, recording; with synthetic results.

``python -m benchmarks.bench_fleet_store [FLIGHTS]`` prints the figures.
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
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.fleet import write_fleet
from groundstation.pipeline.many_flights.fleet_share import share_of, to_arrow
from groundstation.pipeline.many_flights.fleet_store import key_of, month_of, put_month, refresh, scan, stamp_of
from groundstation.pipeline.many_flights.known_flights import KnownFlights
from groundstation.pipeline.many_flights.publishing import write_index_of
from groundstation.pipeline.many_flights.session_search import members_of
from groundstation.reports.fleet_report import write_fleet_report
from groundstation.results.file_names import ARRAYS, MANIFEST, SUMMARY
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


def make_fleet(out: Path, templates: list[Path], flights: int) -> None:
    """Make a folder of flights, and what workers put into the dataset of them, as if they had read them."""
    shares = [share_of(template) for template in templates]
    rng = np.random.default_rng(7)
    months: dict[str, list[int]] = {}
    for number in range(flights):
        months.setdefault(month_of(identity_of(number, flights)), []).append(number)
    for month, numbers in months.items():
        made, keys = [], []
        for number in numbers:
            identity, share = identity_of(number, flights), shares[number % TEMPLATES]
            make_flight(out, identity, templates[number % TEMPLATES])
            start = datetime.strptime(identity[:16], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)
            own = {
                "flight_id": identity,
                "aircraft": f"A{number % AIRCRAFT:02d}",
                "start_utc": int(start.timestamp()) * NS_PER_S,
                "month": f"{start:%Y-%m}",
                "error_deg": round(float(rng.normal(0.02 * (number % AIRCRAFT), 0.2)), 4),
            }
            index = replace(share.index, flight_id=identity, aircraft=own["aircraft"], sha256=f"{number:064x}")
            made.append(replace(share, row=share.row | own, index=index, path=f"/logs/{number}.ulg"))
            keys.append(key_of(made[-1], stamp_of(out, identity) or 0))
        put_month(out, month, to_arrow(made), keys)


def timed(what: str, work: Callable[[], Any]) -> Any:
    """Do something; print its seconds, by the clock and of this process, and the largest this process has been."""
    began, worked = time.perf_counter(), time.process_time()
    found = work()
    seconds, busy_s = time.perf_counter() - began, time.process_time() - worked
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{what:<50}{seconds:8.1f} s by the clock {busy_s:8.1f} s busy {peak_gb:6.2f} GB", flush=True)
    return found


def one_more(out: Path) -> None:
    """What a run does beside the flight itself when it adds one."""
    KnownFlights(scan(out))
    found, problems = refresh(out)
    members_of(found)
    assert not problems and not found.stale
    write_index_of(out, (), (), found)


def main() -> None:
    """Print all figures."""
    flights = int(sys.argv[1]) if len(sys.argv) > 1 else FLIGHTS
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        out.mkdir()
        templates = [
            save_flight(Path(folder), number, samples=1600, forecast=skill((1.0, 5.0, 10.0, 30.0, 60.0, 90.0)))
            for number in range(TEMPLATES)
        ]
        timed(f"{TEMPLATES} flights read by a worker", lambda: refresh(Path(folder)))
        maker = multiprocessing.get_context("spawn").Process(target=make_fleet, args=(out, templates, flights))
        maker.start()  # its memory is not that of the process that leads a run
        maker.join()
        found = scan(out)
        assert len(found) == len(found.fresh) == flights
        run(out, templates, flights)


def run(out: Path, templates: list[Path], flights: int) -> None:
    """What a run, ``report`` and users do with such a folder."""
    last = identity_of(flights - 1, flights)
    shutil.rmtree(out / last)
    timed("one flight gone", lambda: one_more(out))
    (out / last).mkdir()
    shutil.copytree(templates[0], out / last, dirs_exist_ok=True)
    timed("one flight added", lambda: one_more(out))
    fleet, _problems = timed("fleet put together", lambda: write_fleet(out, scan(out)))
    timed("summary.html", lambda: write_fleet_report(out, fleet, with_pdf=False))
    timed("fleet.rrd", lambda: write_fleet_recording(out / "fleet.rrd", fleet))
    for name in ("index.json", "index.csv", "summary.html", "fleet.rrd"):
        print(f"{name:<50}{(out / name).stat().st_size / 1e6:8.1f} MB")
    files = list((out / "flights.parquet").iterdir())
    print(f"{'flights.parquet':<50}{sum(one.stat().st_size for one in files) / 1e6:8.1f} MB in {len(files)} files")
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(out / "fleet.rrd")]
    checked = subprocess.run(command, check=False, capture_output=True)
    print(f"rerun rrd verify: {'passed' if checked.returncode == 0 else checked.stderr.decode()[-300:]}")


if __name__ == "__main__":
    main()
