"""Flights whose INS states a serial, saved without logs, for the tests of what an OUT learns of installations."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from groundstation.base.timescales import utc_ns_to_stamp
from groundstation.results.files import save
from groundstation.results.roles import AzimuthEstimate, EarlyAzimuth, IntervalPart
from groundstation.systems.heading.answer import HeadingResult, TaxiWind
from groundstation.systems.inertial.answer import InertialResult
from tests.fleet_example import DAY_NS, START_NS
from tests.report_example import MANIFEST, example, heading_result
from tests.systems.inertial.example import inertial_result

PARTS = (IntervalPart("taxi", 0.07, 0.14), IntervalPart("wind", 0.05, 0.1), IntervalPart("installation", 0.05, 0.1))


def heading_of(error_deg: float, **changes: Any) -> HeadingResult:
    """A heading correction with what learning needs; one straight due north, wind from the right."""
    plain = heading_result(
        figures=(),
        error_deg=error_deg,
        samples=0,
        settings={"whole_half_width_max_deg": 0.333333, "whole_decides": True},
        confidence95_deg=(error_deg - 0.2, error_deg + 0.2),
        interval_parts=PARTS,
        mean_direction=(1.0, 0.0),
        wind=TaxiWind(0.0, -4.0, 1.5, "METAR XXXX"),
        aircraft_class="jet trainer",
        sideslip_deg=0.108,
        platform_error_deg=error_deg,
        reference_time_s=200.0,
        runway=(),
        onboard=None,
        reference_parking_heading_deg=None,
        reference_residual_arcmin=None,
    )
    return replace(plain, **changes)


def inertial_of(azimuth_deg: float | None) -> InertialResult:
    """Errors of an unaided INS, its azimuth seen in turns or not."""
    if azimuth_deg is None:
        return inertial_result(figures=(), azimuth=AzimuthEstimate(False, None, None, 0, 0.0, "straight"))
    early = EarlyAzimuth(azimuth_deg, 0.03, 1800.0, 0.0, 0.01, 0.0, 4)
    return inertial_result(
        figures=(), azimuth=AzimuthEstimate(True, azimuth_deg, 0.03, 4, 200.0, "turns", 1800.0, early)
    )


def save_installed(
    out: Path,
    day: int,
    error_deg: float = 0.3,
    azimuth_deg: float | None = 0.0,
    *,
    serial: str = "S1",
    aircraft: str = "A1",
    is_timed: bool = True,
    alignment: str = "stored heading",
    **changes: Any,
) -> Path:
    """Save the flight of a day; ``changes`` are of its heading correction."""
    start_ns = START_NS + day * DAY_NS
    inertial = replace(inertial_of(azimuth_deg), ins_topic="ins")
    metadata = {"aircraft": aircraft, "flight": str(day), "ins_alignment": alignment}
    results = example(
        heading_of(error_deg, **changes),
        inertial,
        flight_id=f"{utc_ns_to_stamp(start_ns)}_{day}" if is_timed else f"NOTIME_{day:08d}",
        metadata=metadata | ({"ins_serial": serial} if serial else {}),
        start_utc_ns=start_ns if is_timed else None,
        figures=(),
        findings=(),
    )
    folder = out / results.flight_id
    save(folder, results, MANIFEST)
    return folder
