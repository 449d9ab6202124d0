"""Simulated session as logs: a flat CSV for each aircraft, ground stations, settings.

The settings fit the session.
"""

import json
import re
from dataclasses import asdict
from pathlib import Path

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.ecef import geodetic_deg_m
from groundstation.base.local_frame import LocalFrame, heading_of, level_direction
from groundstation.base.records import Column, Int64Array
from groundstation.base.timescales import iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import LIGHT_MPS, NS_PER_S
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.session import SimulatedSession, VehicleTruth, simulate_session
from groundstation.simulation.session_scenario import SessionScenario
from groundstation.tables.session import DeadReckoning, Session
from groundstation.tables.table import Flight, Table

DEFAULT_SEED = 1
STATIONS_TOML, SETTINGS_TOML = "stations.toml", "settings.toml"
STEPS = {"deg": 1e-9, "m": 1e-4, "mps": 1e-5, "": 1.0, "s": 1e-9}  # steps of written values, by unit
HEADING_STEP_DEG = 1e-6
VELOCITY_AXES = ("north", "east", "down")


def write_session(scenario: SessionScenario, folder: Path, name: str, seed: int | None = None) -> list[Path]:
    """Simulate a session and write ``<name>-<aircraft>.csv``, stations.toml and settings.toml.

    Parameters
    ----------
    scenario : SessionScenario
        In a local frame its plane is laid on the ellipsoid at latitude and longitude of the scenario; the origin
        stands in stations.toml.
    folder : Path
        Made when missing.
    name : str
        Name of the session, which the logs give as their flight.
    seed : int, optional

    Returns
    -------
    list of Path
        Logs in the order of the aircraft, then the two TOML files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    simulated = simulate_session(scenario, DEFAULT_SEED if seed is None else seed)
    origin = origin_of(scenario)
    paths = []
    for flight in session_flights(simulated, scenario, name):
        path = folder / log_name(name, flight.metadata["aircraft"])
        write_flat_csv(path, flight, resolution=_resolution(flight), with_truth=True)
        paths.append(path)
    texts = {STATIONS_TOML: stations_text(simulated.session, origin), SETTINGS_TOML: settings_text(scenario)}
    for file, text in texts.items():
        (folder / file).write_bytes(text.encode())
        paths.append(folder / file)
    return paths


def session_paths(scenario: SessionScenario, folder: Path, name: str) -> list[Path]:
    """The files that :func:`write_session` writes."""
    logs = [folder / log_name(name, aircraft.name) for aircraft in scenario.aircraft]
    return [*logs, folder / STATIONS_TOML, folder / SETTINGS_TOML]


def log_name(name: str, aircraft: str) -> str:
    """File name of the log of one aircraft.

    Examples
    --------
    >>> log_name("three", "RA 07/1")
    'three-RA-07-1.csv'
    """
    return f"{name}-{re.sub(r'[^A-Za-z0-9_-]+', '-', aircraft)}.csv"


def origin_of(scenario: SessionScenario) -> LocalFrame | None:
    """Origin of the plane of a local session; None for a global one."""
    return LocalFrame(scenario.latitude_deg, scenario.longitude_deg) if scenario.frame == "local" else None


def session_flights(simulated: SimulatedSession, scenario: SessionScenario, name: str) -> list[Flight]:
    """Return the session as the flights that its aircraft recorded.

    Times count since ``start_utc`` of the scenario. A range is recorded when it arrives: time of transmission and the
    pseudo-range over the speed of light.
    """
    start_ns, _ = iso_to_utc_ns(scenario.satellite.start_utc)
    origin = origin_of(scenario)
    flights = []
    for vehicle, truth in zip(simulated.session.vehicles, simulated.truth, strict=True):
        assert isinstance(vehicle, DeadReckoning)
        topics = {"ins": _ins(vehicle, origin), **_links(simulated.session, vehicle.name)}
        topics |= {**_satellites(simulated.session, vehicle.name), "truth": _truth(vehicle, truth, origin)}
        metadata = {"aircraft": vehicle.name, "flight": name, "start_utc": utc_ns_to_iso(start_ns)}
        flights.append(_flight(topics, metadata, start_ns))
    return flights


Samples = tuple[Int64Array, dict[str, FloatArray]]


def _flight(topics: dict[str, Samples], metadata: dict[str, str], start_ns: int) -> Flight:
    """Tables whose rows of equal time are one row of the log."""
    times = np.unique(np.concatenate([time_ns for time_ns, _ in topics.values()]))
    tables = {}
    for topic, (time_ns, values) in topics.items():
        columns = {field: Column(value) for field, value in values.items()}
        tables[topic] = Table(topic, time_ns + start_ns, columns, np.searchsorted(times, time_ns), Column(time_ns))
    return Flight(tables, metadata, int(times[0]) + start_ns, has_utc=True)


def _ns(time_s: FloatArray) -> Int64Array:
    return np.rint(time_s * NS_PER_S).astype(np.int64)


def _motion(position_m: FloatArray, velocity_mps: FloatArray, origin: LocalFrame | None) -> dict[str, FloatArray]:
    """Return positions and velocities of the session's frame as an INS has them."""
    ecef = position_m if origin is None else origin.to_ecef_m(position_m)
    latitude, longitude, altitude = geodetic_deg_m(ecef)
    velocity = velocity_mps if origin is None else origin.turned_to(latitude, longitude, velocity_mps)
    columns = {"latitude_deg": latitude, "longitude_deg": longitude, "altitude_ellipsoid_m": altitude}
    return columns | {f"velocity_{axis}_mps": velocity[:, k].copy() for k, axis in enumerate(VELOCITY_AXES)}


def _ins(vehicle: DeadReckoning, origin: LocalFrame | None) -> Samples:
    columns = _motion(vehicle.position_m, vehicle.velocity_mps, origin)
    heading = vehicle.heading_deg
    if origin is not None:
        there = origin.turned_to(columns["latitude_deg"], columns["longitude_deg"], level_direction(heading))
        heading = heading_of(there)
    return _ns(vehicle.time_s), {**columns, "true_heading_deg": heading}


def _truth(vehicle: DeadReckoning, truth: VehicleTruth, origin: LocalFrame | None) -> Samples:
    velocity = vehicle.velocity_mps.copy()
    velocity[:, :2] -= truth.states[:, 2:4]
    return _ns(truth.time_s), _motion(truth.position_m, velocity, origin)


def _links(session: Session, receiver: str) -> dict[str, Samples]:
    ranges, found = session.ranges, {}
    for source in dict.fromkeys(ranges.source[ranges.receiver == receiver].tolist()):
        rows = (ranges.receiver == receiver) & (ranges.source == source)
        columns = {
            "pseudorange_m": ranges.pseudorange_m[rows],
            "transmission_time_s": ranges.time_s[rows],
            "slot": ranges.slot[rows].astype(np.float64),
        }
        found[f"link.{source}"] = _ns(ranges.time_s[rows] + ranges.pseudorange_m[rows] / LIGHT_MPS), columns
    return found


def _satellites(session: Session, receiver: str) -> dict[str, Samples]:
    table, found = session.satellites, {}
    for name in dict.fromkeys(table.satellite[table.receiver == receiver].tolist()):
        rows = (table.receiver == receiver) & (table.satellite == name)
        columns = {"pseudorange_m": table.pseudorange_m[rows]}
        columns |= {f"{axis}_m": table.position_m[rows, k].copy() for k, axis in enumerate("xyz")}
        found[f"satellite.{name}"] = _ns(table.time_s[rows]), columns
    return found


def _resolution(flight: Flight) -> dict[str, float]:
    steps = {}
    for topic in flight.topics():
        for field in flight[topic].columns:
            unit = next((unit for unit in STEPS if unit and field.endswith(f"_{unit}")), "")
            steps[f"{topic}.{field}"] = HEADING_STEP_DEG if field == "true_heading_deg" else STEPS[unit]
    return steps


def stations_text(session: Session, origin: LocalFrame | None) -> str:
    """The ground points as stations.toml, with the origin of a local frame."""
    lines = ["# Ground stations as everybody believes them to be."]
    if origin is not None:
        lines += ["", "# A local frame: its plane touches the ellipsoid here.", "[origin]"]
        lines += [f"{key} = {value!r}" for key, value in asdict(origin).items()]
    for point in session.points:
        place = np.array(point.position_m)
        latitude, longitude, altitude = geodetic_deg_m(place if origin is None else origin.to_ecef_m(place))
        lines += ["", "[[stations]]", f"name = {json.dumps(point.name)}"]
        lines += [f"latitude_deg = {latitude:.9f}", f"longitude_deg = {longitude:.9f}"]
        lines += [f"altitude_ellipsoid_m = {altitude:.4f}", f"position_sigma_m = {point.position_sigma_m!r}"]
        lines += [f"rank = {session.ranks[point.name]}"] if point.name in session.ranks else []
    vehicles = [(name, session.ranks[name]) for name in session.names if name in session.ranks]
    if vehicles:
        lines += ["", "# Ranks of accuracy of the aircraft, 0 the highest.", "[ranks]"]
        lines += [f"{json.dumps(name)} = {rank}" for name, rank in vehicles]
    return "\n".join([*lines, ""])


def settings_text(scenario: SessionScenario) -> str:
    """Return what a filter may believe of the scenario, as text of a settings file.

    Its tables are [session] and [cooperative.ins].
    """
    lines = ["# The sigmas that the scenario draws its errors with.", "[session]"]
    lines += [f"range_sigma_m = {scenario.link.range_sigma_m!r}"]
    lines += [f"satellite_range_sigma_m = {scenario.satellite.range_sigma_m!r}", "", "[cooperative.ins]"]
    for key, value in asdict(scenario.errors).items():
        lines.append(f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}")
    return "\n".join([*lines, ""])
