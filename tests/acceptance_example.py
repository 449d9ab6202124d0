"""Folders of flights whose INS errs by a known rate: saved results, made without logs, for acceptance and rules."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.timescales import utc_ns_to_stamp
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.results.files import save
from groundstation.results.flight import FlightResults
from groundstation.systems.heading.answer import HeadingResult
from tests.figure_arrays import filled
from tests.fleet_example import DAY_NS, START_NS
from tests.report_example import MANIFEST, example
from tests.systems.inertial.example import inertial_result

ROWS = 61


def save_flight(
    out: Path,
    number: int,
    rate_nmiph: float,
    *,
    ins: str = "S-1",
    hours: float = 3.0,
    heading: HeadingResult | None = None,
    **changes: Any,
) -> Path:
    """Save flight ``number``: a straight flight east whose radial error grows by ``rate_nmiph``, 3 along to 4 across.

    ``changes`` are of its INS errors.
    """
    time = np.linspace(0.0, hours * 3600.0, ROWS)
    error_m = rate_nmiph * time / 3600.0 * M_PER_NAUTICAL_MILE
    states = filled(
        "inertial_states",
        time_s=time,
        measured_north_position_m=0.8 * error_m,
        measured_east_position_m=0.6 * error_m,
    )
    track = filled(
        "inertial_track", time_s=time, ins_latitude_deg=np.zeros(ROWS), ins_longitude_deg=10.0 + 0.002 * time
    )
    gnss = {"position_white_m": 3.0, "position_correlated_m": 4.0, "velocity_white_mps": 0.03}
    settings: dict[str, float | str | bool] = {f"noise.gnss.{name}": value for name, value in gnss.items()}
    settings["noise.gnss.velocity_correlated_mps"] = 0.04
    inertial = replace(
        inertial_result(velocity_error_rms_mps=0.5 * rate_nmiph, settings=settings, figures=()), **changes
    )
    start_ns = START_NS + number * DAY_NS
    results: FlightResults = example(
        heading,
        None,
        flight_id=f"{utc_ns_to_stamp(start_ns)}_{number}",
        metadata={"aircraft": f"A-{ins}", "flight": str(number), "ins_serial": ins},
        start_utc_ns=start_ns,
        figures=(states, track),
    )
    answers = dict(results.answers) | {"inertial": inertial}
    source = replace(results.source, sha256=f"{number:064x}")
    results = replace(results, answers=answers, source=source)
    save(out / results.flight_id, results, MANIFEST)
    return out / results.flight_id


def save_fleet(out: Path, rates_nmiph: Sequence[float], ins: Sequence[str] = ()) -> None:
    """Save a flight for each rate; ``ins`` names the units, left out each flight has one of its own."""
    for number, rate in enumerate(rates_nmiph):
        save_flight(out, number, rate, ins=ins[number] if ins else f"S-{number}")
