"""Flat CSV of a flight with several units: ``ins``, ``ins.1``, ``ins.2``, ``gnss``."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.ins_units.flight import UnitsFlight, simulate_units
from groundstation.simulation.ins_units.scenario import UnitsScenario
from groundstation.simulation.ins_units.unit_faults import UnitRecord
from groundstation.tables.table import Flight, FloatArray, Table

AXES = ("north", "east", "down")
GNSS_POSITION_STEP_DEG, GNSS_VELOCITY_STEP_MPS = 1e-8, 1e-4
ALTITUDE_STEP_M = 0.1


def units_log(flight: UnitsFlight, scenario: UnitsScenario) -> Flight:
    """Put a flight into tables. A unit has the stamps that it writes itself.

    Serials are metadata: ``ins_serial`` of the first unit, ``ins_serial.<topic>`` of the others; where another unit
    takes over in flight ``<serial>, <serial> from <second>``.
    """
    columns = {unit.topic: _unit_columns(unit) for unit in flight.units}
    stamps_s = {unit.topic: unit.stamp_s for unit in flight.units}
    if flight.gnss is not None:
        columns["gnss"], stamps_s["gnss"] = _gnss_columns(flight), flight.gnss.time_s
    if scenario.with_truth:
        columns["truth"], stamps_s["truth"] = _truth_columns(flight), flight.time_s
    times_ns = {topic: _nanoseconds(stamp_s) for topic, stamp_s in stamps_s.items()}
    first_ns = min(0, *(int(one[0]) for one in times_ns.values() if len(one)))  # no stamp before the log's zero
    start_ns = scenario.start_utc_ns + first_ns
    rows = np.unique(np.concatenate(list(times_ns.values())))
    tables = {
        topic: Table(
            topic,
            time_ns + scenario.start_utc_ns,
            {name: Column(values) for name, values in columns[topic].items()},
            np.searchsorted(rows, time_ns).astype(np.int64),
            Column(time_ns - first_ns),
        )
        for topic, time_ns in times_ns.items()
    }
    return Flight(tables, _metadata(flight, scenario, start_ns), start_ns, has_utc=True, source_name=scenario.log_name)


def write_units(scenario: UnitsScenario, folder: str | Path, seed: int | None = None) -> Path:
    """Simulate a flight with several units and write its log ``<folder>/<name>.csv``."""
    path = Path(folder) / scenario.log_name
    path.parent.mkdir(parents=True, exist_ok=True)
    flight = simulate_units(scenario.flown, scenario.seed if seed is None else seed, scenario.run)
    write_flat_csv(path, units_log(flight, scenario), resolution=_resolution(flight), with_truth=scenario.with_truth)
    return path


def _nanoseconds(time_s: FloatArray) -> Int64Array:
    return np.rint(time_s * NS_PER_S).astype(np.int64)


def _unit_columns(unit: UnitRecord) -> dict[str, NDArray[np.generic]]:
    found: dict[str, NDArray[np.generic]] = {}
    if unit.has_position:
        found |= {"latitude_deg": unit.latitude_deg, "longitude_deg": unit.longitude_deg}
    found |= {
        "altitude_ellipsoid_m": unit.altitude_m,
        **{f"velocity_{axis}_mps": one for axis, one in zip(AXES, unit.velocity_mps.T, strict=False)},
        "velocity_down_mps": unit.velocity_down_mps,
        "roll_deg": unit.roll_deg,
        "true_heading_deg": unit.heading_deg,
    }
    if unit.states_aiding:
        found["mode"] = np.full(len(unit.stamp_s), "gnss_aided")
    return found


def _gnss_columns(flight: UnitsFlight) -> dict[str, NDArray[np.generic]]:
    fixes = flight.gnss
    assert fixes is not None
    return {
        "latitude_deg": fixes.latitude_deg,
        "longitude_deg": fixes.longitude_deg,
        "altitude_ellipsoid_m": fixes.altitude_m,
        "velocity_north_mps": fixes.velocity_mps[:, 0],
        "velocity_east_mps": fixes.velocity_mps[:, 1],
    }


def _truth_columns(flight: UnitsFlight) -> dict[str, NDArray[np.generic]]:
    motion = flight.truth.motion
    return {
        "latitude_deg": motion.latitude_deg[0],
        "longitude_deg": flight.truth.longitude_deg,
        "altitude_ellipsoid_m": motion.altitude_m[0],
        **{f"velocity_{axis}_mps": getattr(motion, f"velocity_{axis}_mps")[0] for axis in AXES},
        "roll_deg": motion.roll_deg[0],
        "true_heading_deg": motion.heading_deg[0],
    }


def _metadata(flight: UnitsFlight, scenario: UnitsScenario, start_ns: int) -> dict[str, str]:
    found = {"aircraft": scenario.aircraft, "flight": scenario.name, "start_utc": _iso(start_ns)}
    if isinstance(flight.settings.ins, str):
        found["ins_class"] = flight.settings.ins
    if flight.settings.ins_of_others:
        found |= {f"ins_class.{unit.topic}": flight.settings.ins_of_others for unit in flight.units[1:]}
    stated = dict(zip((unit.topic for unit in flight.units), scenario.serials, strict=False))
    for unit in flight.units:
        (_from_s, first), *later = unit.serials
        first = stated.get(unit.topic, first)
        if not first:
            continue
        text = ", ".join([first, *(f"{serial} from {from_s:g}" for from_s, serial in later)])
        found["ins_serial" if unit.topic == "ins" else f"ins_serial.{unit.topic}"] = text
    if flight.settings.states_start:
        found["nav_start_utc"] = _iso(scenario.start_utc_ns)
    return found | {"datum": "WGS-84"}


def _iso(time_ns: int) -> str:
    return f"{np.datetime64(time_ns, 'ns').astype('datetime64[ms]')}Z"


def _resolution(flight: UnitsFlight) -> Mapping[str, float]:
    """Return the steps of the fields; outputs that are not rounded get many digits."""
    output, found = flight.settings.output, dict[str, float]()
    position, velocity, angle = (
        output.position_step_deg or 1e-9,
        output.velocity_step_mps or 1e-6,
        output.heading_step_deg or 1e-6,
    )
    for topic in [unit.topic for unit in flight.units]:
        found |= {f"{topic}.{name}_deg": position for name in ("latitude", "longitude")}
        found |= {f"{topic}.velocity_{axis}_mps": velocity for axis in AXES}
        found |= {f"{topic}.{name}_deg": angle for name in ("roll", "true_heading")}
        found[f"{topic}.altitude_ellipsoid_m"] = ALTITUDE_STEP_M
    found |= {f"gnss.{name}_deg": GNSS_POSITION_STEP_DEG for name in ("latitude", "longitude")}
    found |= {f"gnss.velocity_{axis}_mps": GNSS_VELOCITY_STEP_MPS for axis in AXES}
    found |= {f"truth.{name}_deg": 1e-9 for name in ("latitude", "longitude")}
    found |= {f"truth.velocity_{axis}_mps": 1e-6 for axis in AXES}
    return found
