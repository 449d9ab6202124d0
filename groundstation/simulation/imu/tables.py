"""Tables of a simulated log of an inertial unit, and its flat CSV."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.imu.flight import ImuFlight
from groundstation.simulation.imu.motion import true_states
from groundstation.simulation.imu.scenario import ImuScenario
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]
AXES = ("north", "east", "down")
RESOLUTION: Mapping[str, float] = {
    **{f"imu.delta_angle_{axis}_rad": 1e-10 for axis in "xyz"},
    **{f"imu.delta_velocity_{axis}_mps": 1e-9 for axis in "xyz"},
    **{f"imu.rate_{axis}_dps": 1e-7 for axis in "xyz"},
    **{f"imu.accel_{axis}_mps2": 1e-7 for axis in "xyz"},
    **{f"{topic}.{axis}_deg": 1e-9 for topic in ("gnss", "truth") for axis in ("latitude", "longitude")},
    **{f"{topic}.altitude_ellipsoid_m": 1e-4 for topic in ("gnss", "truth")},
    "baro.pressure_altitude_m": 1e-3,
    "odometry.speed_mps": 1e-4,
    **{f"magnetometer.field_{axis}_nt": 0.1 for axis in ("forward", "right", "down")},
    **{f"truth.{angle}_deg": 1e-5 for angle in ("roll", "pitch", "true_heading")},
}


def log_tables(flight: ImuFlight, scenario: ImuScenario) -> Flight:
    """Put a log into tables ``imu``, ``gnss``, ``truth``, and those of its aids.

    The truth has the rate that the scenario says. Rows are numbered in the order in which they were logged: that of
    their stamps, but for stamps that step back.
    """
    columns = {"imu": imu_columns(flight), "gnss": gnss_columns(flight)}
    stamp_s: dict[str, FloatArray] = {"imu": flight.time_s, "gnss": flight.gnss.time_s}
    logged_s: dict[str, FloatArray] = {"imu": np.maximum.accumulate(flight.time_s), "gnss": flight.gnss.time_s}
    for topic, (times_s, found) in aid_columns(flight).items():
        columns[topic], stamp_s[topic], logged_s[topic] = found, times_s, times_s
    if scenario.truth_rate_hz > 0.0:
        stamp_s["truth"] = np.arange(0.0, flight.settings.duration_s, 1.0 / scenario.truth_rate_hz)
        logged_s["truth"] = stamp_s["truth"]
        columns["truth"] = truth_columns(flight, stamp_s["truth"])
    order = np.argsort(np.concatenate(list(logged_s.values())), kind="stable")
    place: Int64Array = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    tables, first = {}, 0
    for topic, times_s in stamp_s.items():
        time_ns = nanoseconds(times_s)
        rows = place[first : first + len(time_ns)]
        first += len(time_ns)
        named = {name: Column(values) for name, values in columns[topic].items()}
        tables[topic] = Table(topic, time_ns + scenario.start_utc_ns, named, rows, Column(time_ns))
    metadata = {"aircraft": scenario.aircraft, "flight": scenario.name, "start_utc": scenario.start_utc}
    metadata["datum"] = "WGS-84"
    return Flight(tables, metadata, scenario.start_utc_ns, has_utc=True, source_name=f"{scenario.name}.csv")


def nanoseconds(time_s: FloatArray) -> Int64Array:
    """Return times of the log as whole nanoseconds."""
    return np.rint(time_s * NS_PER_S).astype(np.int64)


def imu_columns(flight: ImuFlight) -> dict[str, NDArray[np.generic]]:
    """Return the columns of ``imu``: increments, or rates and specific force."""
    step_s = flight.interval_s[:, None]
    if flight.is_integral:
        found = {f"delta_angle_{axis}_rad": one for axis, one in zip("xyz", flight.delta_angle_rad.T, strict=True)}
        found |= {f"delta_velocity_{axis}_mps": v for axis, v in zip("xyz", flight.delta_velocity_mps.T, strict=True)}
        found["interval_s"] = flight.interval_s
    else:
        rates_dps, forces = np.rad2deg(flight.delta_angle_rad / step_s), flight.delta_velocity_mps / step_s
        found = {f"rate_{axis}_dps": one for axis, one in zip("xyz", rates_dps.T, strict=True)}
        found |= {f"accel_{axis}_mps2": one for axis, one in zip("xyz", forces.T, strict=True)}
    return {**found, "is_integral": np.full(len(flight.time_s), flight.is_integral)}


def gnss_columns(flight: ImuFlight) -> dict[str, NDArray[np.generic]]:
    """Return the columns of ``gnss``."""
    fixes = flight.gnss
    position, velocity = fixes.position_sigma_m, fixes.velocity_sigma_mps
    return {
        "latitude_deg": fixes.latitude_deg,
        "longitude_deg": fixes.longitude_deg,
        "altitude_ellipsoid_m": fixes.height_m,
        **{f"velocity_{axis}_mps": one for axis, one in zip(AXES, fixes.velocity_mps.T, strict=True)},
        "horizontal_sigma_m": np.hypot(position[:, 0], position[:, 1]),
        "vertical_sigma_m": position[:, 2],
        "velocity_sigma_mps": velocity[:, 0],
        **{f"position_{axis}_sigma_m": position[:, place] for place, axis in enumerate(AXES[:2])},
        **{f"velocity_{axis}_sigma_mps": one for axis, one in zip(AXES, velocity.T, strict=True)},
        "fix": np.where(fixes.is_precise, "rtk_fixed", "3d"),
    }


def aid_columns(flight: ImuFlight) -> dict[str, tuple[FloatArray, dict[str, NDArray[np.generic]]]]:
    """Return times and columns of the topics of aids that the log has."""
    aids = flight.aids
    found: dict[str, tuple[FloatArray, dict[str, NDArray[np.generic]]]] = {}
    if len(aids.baro_s):
        found["baro"] = aids.baro_s, {"pressure_altitude_m": aids.pressure_altitude_m}
    if len(aids.wheel_s):
        found["odometry"] = aids.wheel_s, {"speed_mps": aids.speed_mps}
    if len(aids.compass_s):
        axes = zip(("forward", "right", "down"), aids.field_nt.T, strict=True)
        found["magnetometer"] = aids.compass_s, {f"field_{axis}_nt": one for axis, one in axes}
    return found


def truth_columns(flight: ImuFlight, time_s: FloatArray) -> dict[str, NDArray[np.generic]]:
    """Return the columns of ``truth`` at times of the log."""
    states = true_states(flight.motion, time_s)
    return {
        "latitude_deg": states.latitude_deg,
        "longitude_deg": states.longitude_deg,
        "altitude_ellipsoid_m": states.height_m,
        **{f"velocity_{axis}_mps": one for axis, one in zip(AXES, states.velocity_mps.T, strict=True)},
        "roll_deg": states.roll_deg,
        "pitch_deg": states.pitch_deg,
        "true_heading_deg": states.heading_deg,
    }


def write_csv(path: Path, flight: ImuFlight, scenario: ImuScenario) -> None:
    """Write the log as flat CSV, its truth in the topic ``truth``."""
    write_flat_csv(path, log_tables(flight, scenario), resolution=RESOLUTION, with_truth=True)


def write_truth(path: Path, flight: ImuFlight, scenario: ImuScenario) -> None:
    """Write the truth alone as flat CSV: a reference for logs whose format has no room for it."""
    whole = log_tables(flight, scenario)
    write_flat_csv(path, replace(whole, tables={"truth": whole["truth"]}), resolution=RESOLUTION, with_truth=True)
