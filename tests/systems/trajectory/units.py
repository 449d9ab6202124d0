"""Inertial units and receivers for tests of the mounting: simulated ones, recorded ones, and what is done to them."""

import gzip
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.simulation.imu.families import Family
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.settings import ImuSettings, MountingSettings, ReceiverSettings
from groundstation.systems.trajectory.axis_turns import axis_turns, signed_permutations
from groundstation.systems.trajectory.gnss_input import gnss_of
from groundstation.systems.trajectory.imu_input import imu_of
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements
from groundstation.tables.table import Flight
from groundstation.tables.vehicle import VehicleKind
from tests.real_logs import real_log

FloatArray = NDArray[np.float64]
Pair = tuple[ImuIncrements, GnssFixes]
KINDS: dict[Family, VehicleKind] = {"drive": "rolls", "uav": "flies", "hover": "flies", "start_in_motion": "flies"}
SHORT_S = 300.0
TURNS = axis_turns()
MIRRORS = signed_permutations()[np.linalg.det(signed_permutations()) < 0.0]
G_MPS2 = 9.80665
# drive_0708: the counter of its log at the start of its time tag, and the start of that after the first fix, seconds.
COUNTER_AT_TAG_S, TAG_AFTER_FIX_S = 261.773, 3.355


@cache
def simulated(
    family: Family,
    seed: int = 1,
    duration_s: float = SHORT_S,
    imu_class: str = "mems",
    mounting: MountingSettings = MountingSettings(),  # noqa: B008 - frozen
    *,
    precise: bool = False,
) -> Pair:
    """Unit and receiver of a simulated log; a precise one has positions to a centimetre."""
    receiver = ReceiverSettings(position_white_m=0.01, position_slow_m=0.02, position_fast_m=0.01)
    settings = ImuSettings(
        duration_s=duration_s,
        imu_class=imu_class,
        mounting=mounting,
        gnss=receiver if precise else ReceiverSettings(),
    )
    return pair_of(simulate_imu(family, seed, settings=settings))


def pair_of(flight: ImuFlight) -> Pair:
    """Unit and receiver of a simulated log."""
    gnss = flight.gnss
    return (
        ImuIncrements(
            flight.time_s, flight.interval_s, flight.delta_angle_rad, flight.delta_velocity_mps, flight.is_integral
        ),
        GnssFixes(
            gnss.time_s,
            gnss.latitude_deg,
            gnss.longitude_deg,
            gnss.height_m,
            gnss.velocity_mps,
            gnss.position_sigma_m,
            gnss.velocity_sigma_mps,
            gnss.is_precise,
        ),
    )


def turned(imu: ImuIncrements, forces: FloatArray, rates: FloatArray | None = None) -> ImuIncrements:
    """A unit with the axes of its accelerometers turned by a matrix, and those of its gyros by the same or another."""
    other = forces if rates is None else rates
    return replace(
        imu, delta_velocity_mps=imu.delta_velocity_mps @ forces.T, delta_angle_rad=imu.delta_angle_rad @ other.T
    )


def scaled(imu: ImuIncrements, forces: float = 1.0, rates: float = 1.0) -> ImuIncrements:
    """A unit in other units."""
    return replace(imu, delta_velocity_mps=imu.delta_velocity_mps * forces, delta_angle_rad=imu.delta_angle_rad * rates)


def fixes(
    time_s: FloatArray, latitude: FloatArray, longitude: FloatArray, height: FloatArray, velocity: FloatArray
) -> GnssFixes:
    """Fixes with sigmas of a common receiver; those without velocity are left out."""
    kept = np.isfinite(velocity).all(axis=1)
    kept[1:] &= np.diff(time_s) > 0.0
    count = int(kept.sum())
    return GnssFixes(
        time_s[kept],
        latitude[kept],
        longitude[kept],
        height[kept],
        velocity[kept],
        np.full((count, 3), 1.5),
        np.full((count, 3), 0.1),
        np.zeros(count, dtype=bool),
    )


@cache
def reference_drive() -> Pair:
    """Unit and receiver of the reference drive."""
    folder = "reference_heading/pntos_drive_first_half"
    with gzip.open(real_log(f"{folder}_imu.csv.gz"), "rt") as file:
        rows = np.genfromtxt(file, delimiter=",", skip_header=2)
    gnss = np.genfromtxt(real_log(f"{folder}_gnss.csv"), delimiter=",", skip_header=2)
    imu = ImuIncrements(rows[:, 0], np.full(len(rows), 0.01), rows[:, 4:7], rows[:, 1:4])
    return imu, fixes(gnss[:, 0], gnss[:, 1], gnss[:, 2], gnss[:, 3], gnss[:, 4:7])


@cache
def drive_0708() -> Pair:
    """Unit of a car, logged in g and degrees per second as point samples, and its RTK solution."""
    rows = np.genfromtxt(real_log("gnss/drive_0708_imu_1934.csv"), delimiter=",", invalid_raise=False)
    time_s = rows[:, 6] / 1e3 - COUNTER_AT_TAG_S + TAG_AFTER_FIX_S
    kept = np.isfinite(rows).all(axis=1)
    kept[1:] &= np.diff(time_s) > 0.0
    rows, time_s = rows[kept], time_s[kept]
    interval_s = np.diff(time_s, prepend=time_s[0] - 0.01)[:, None]
    imu = ImuIncrements(
        time_s, interval_s[:, 0], np.deg2rad(rows[:, 3:6]) * interval_s, rows[:, :3] * G_MPS2 * interval_s, False
    )
    return imu, _rtklib(real_log("gnss/drive_0708_gnss_1934_sf.pos"))


def _rtklib(path: Path) -> GnssFixes:
    lines = [line.split() for line in path.read_text().splitlines() if not line.startswith("%")]
    clock = np.array([np.datetime64(f"{line[0].replace('/', '-')}T{line[1]}") for line in lines])
    time_s = (clock - clock[0]) / np.timedelta64(1, "ms") / 1e3
    numbers = np.array([[float(one) for one in line[2:]] for line in lines])
    velocity = numbers[:, 13:16] * np.array([1.0, 1.0, -1.0])
    return fixes(time_s, numbers[:, 0], numbers[:, 1], numbers[:, 2], velocity)


def of_flight(flight: Flight) -> Pair:
    """Unit and receiver of a log that a reader knows."""
    return imu_of(flight, InputSettings()).imu, gnss_of(flight, (), InputSettings()).gnss
