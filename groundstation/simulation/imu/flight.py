"""Simulated flight of an inertial unit with GNSS: its log, and the truth behind it."""

from dataclasses import field, fields

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.simulation.imu.aids import SimulatedAids, sense
from groundstation.simulation.imu.families import Family, motion_of
from groundstation.simulation.imu.imu_class import load_imu_class
from groundstation.simulation.imu.motion import Motion, Origin, true_states
from groundstation.simulation.imu.receiver import SimulatedFixes, receive
from groundstation.simulation.imu.settings import ImuSettings
from groundstation.simulation.imu.unit import case_from_body, draw_errors, measured, outside, stamps

FloatArray = NDArray[np.float64]
START_UTC_NS = iso_to_utc_ns("2026-05-04T06:00:00Z")[0]


@dataclass(frozen=True)
class ImuFlight:
    """Log of an inertial unit and a receiver, and the truth at the unit's true times.

    Parameters
    ----------
    family : str
    settings : ImuSettings
    motion : Motion
        The truth at any other time, by :func:`groundstation.simulation.imu.motion.true_states`.
    time_s : ndarray, shape (n,)
        Stamps of the ends of the intervals.
    true_time_s : ndarray, shape (n,)
        True ends of the intervals.
    interval_s : ndarray, shape (n,)
        True lengths.
    delta_angle_rad, delta_velocity_mps : ndarrays, shape (n, 3)
        Measured in the axes of the case.
    is_integral : bool
    gnss : SimulatedFixes
    latitude_deg, longitude_deg, height_m, roll_deg, pitch_deg, heading_deg : ndarrays, shape (n,)
        Truth of the unit; attitude of the body.
    velocity_mps : ndarray, shape (n, 3)
        Truth, north, east, down.
    gyro_bias_radps, accelerometer_bias_mps2 : ndarrays, shape (n, 3)
        True biases in the axes of the case: measured - true.
    gyro_matrix, accelerometer_matrix : ndarrays, shape (3, 3)
        True scale factors and misalignments: measured = (I + matrix) true + bias.
    case_from_body : ndarray, shape (3, 3)
        Mounting; its determinant is -1 where an axis is mirrored.
    lever_arm_m : ndarray, shape (3,)
        Antenna from the unit, forward, right, down of the body.
    latency_s : float
        Of the fixes: stamp - validity.
    aids : SimulatedAids
    """

    family: Family
    settings: ImuSettings
    motion: Motion
    time_s: FloatArray
    true_time_s: FloatArray
    interval_s: FloatArray
    delta_angle_rad: FloatArray
    delta_velocity_mps: FloatArray
    is_integral: bool
    gnss: SimulatedFixes
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    velocity_mps: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray
    heading_deg: FloatArray
    gyro_bias_radps: FloatArray
    accelerometer_bias_mps2: FloatArray
    gyro_matrix: FloatArray
    accelerometer_matrix: FloatArray
    case_from_body: FloatArray
    lever_arm_m: FloatArray
    latency_s: float
    aids: SimulatedAids = field(default_factory=SimulatedAids)

    def __post_init__(self) -> None:
        for item in fields(self):
            if isinstance(value := getattr(self, item.name), np.ndarray):
                object.__setattr__(self, item.name, frozen(value))


def simulate_imu(
    family: Family,
    rng: np.random.Generator | int,
    *,
    settings: ImuSettings | None = None,
    start_utc_ns: int = START_UTC_NS,
) -> ImuFlight:
    """Simulate the log of an inertial unit with GNSS.

    Motion, unit, receiver and aids draw from streams of their own: the same seed gives the same motion with other
    errors.

    Parameters
    ----------
    family : {'drive', 'uav', 'hover', 'start_in_motion'}
    rng : numpy.random.Generator or int
        A seed where it is a number.
    settings : ImuSettings, optional
    start_utc_ns : int
        Date of the magnetic field.

    Raises
    ------
    SettingsError
        When there is no such family or class.

    Examples
    --------
    >>> flight = simulate_imu("hover", 1, settings=ImuSettings(duration_s=30.0, rate_hz=50.0))
    >>> flight.delta_angle_rad.shape, flight.gnss.time_s.shape
    ((1500, 3), (150,))
    """
    chosen = ImuSettings() if settings is None else settings
    of_motion, of_unit, of_noise, of_stamps, of_gnss, of_aids = np.random.default_rng(rng).spawn(6)
    origin = Origin(chosen.latitude_deg, chosen.longitude_deg, chosen.height_m)
    motion = motion_of(family, of_motion, origin, chosen.duration_s, chosen.slip_deg_per_mps2)
    step_s = 1.0 / chosen.rate_hz
    end_s: FloatArray = step_s * np.arange(1.0, round(chosen.duration_s * chosen.rate_hz) + 1.0)
    gyro, accelerometer = draw_errors(load_imu_class(chosen.imu_class), of_unit, len(end_s), chosen)
    angle, velocity = measured(motion, end_s, (gyro, accelerometer), of_noise, chosen)
    stamp = stamps(chosen.stamps, end_s, step_s, of_stamps)
    kept = outside(end_s, chosen.stamps.gaps)
    truth = true_states(motion, end_s[kept])
    return ImuFlight(
        family,
        chosen,
        motion,
        stamp[kept],
        end_s[kept],
        np.full(int(kept.sum()), step_s),
        angle[kept],
        velocity[kept],
        chosen.is_integral,
        receive(motion, chosen.duration_s, chosen.mounting.lever_arm_m, of_gnss, settings=chosen.gnss),
        truth.latitude_deg,
        truth.longitude_deg,
        truth.height_m,
        truth.velocity_mps,
        truth.roll_deg,
        truth.pitch_deg,
        truth.heading_deg,
        gyro.bias[kept],
        accelerometer.bias[kept],
        gyro.matrix,
        accelerometer.matrix,
        case_from_body(chosen.mounting),
        np.array(chosen.mounting.lever_arm_m),
        chosen.gnss.latency_s,
        sense(motion, of_aids, settings=chosen, start_utc_ns=start_utc_ns),
    )
