"""Families of simulated logs for the study, and the model that knows their noise."""

from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.simulation.imu.families import Family
from groundstation.simulation.imu.imu_class import load_imu_class
from groundstation.simulation.imu.settings import ImuSettings, ReceiverSettings, StampSettings
from groundstation.simulation.scenario import LogInterval
from groundstation.systems.trajectory.model import HOUR, Model, StartSigmas

DURATION_S = 400.0
GAPS = (LogInterval(150.0, 150.4), LogInterval(260.0, 260.15))


def _hard(imu_class: str) -> ImuSettings:
    """Return a log with scale 0.5 %, misalignment 0.3 deg, jitter, gaps, latency 0.3 s."""
    return ImuSettings(
        duration_s=DURATION_S,
        imu_class=imu_class,
        scale_factor=0.005,
        misalignment_deg=0.3,
        stamps=StampSettings(jitter_s=0.003, gaps=GAPS),
        gnss=ReceiverSettings(latency_s=0.3),
    )


@dataclass(frozen=True)
class StudyFamily:
    """Family of logs: motion, and the settings of unit, stamps and receiver."""

    name: str
    what: str
    motion: Family
    unit: ImuSettings = field(default_factory=ImuSettings)


FAMILIES: tuple[StudyFamily, ...] = (
    StudyFamily("uav-mems", "fixed wing, industrial MEMS unit", "uav", _hard("mems")),
    StudyFamily("uav-consumer", "fixed wing, consumer unit", "uav", _hard("consumer")),
    StudyFamily("hover-mems", "multicopter, industrial MEMS unit", "hover", _hard("mems")),
    StudyFamily("hover-consumer", "multicopter, consumer unit", "hover", _hard("consumer")),
    StudyFamily(
        "start-in-motion", "fixed wing whose log begins in flight, MEMS unit", "start_in_motion", _hard("mems")
    ),
)


def known_model(settings: ImuSettings) -> Model:
    """Return the model with the noise of a simulated log: nothing is fitted.

    The Gauss-Markov biases of the simulation are random walks here: of the same growth over times short against their
    correlation.
    """
    unit, gnss = load_imu_class(settings.imu_class), settings.gnss
    total = float(np.sqrt(gnss.position_white_m**2 + gnss.position_slow_m**2 + gnss.position_fast_m**2))
    gyro_dps, accel_mg = unit.gyro_random_dph / HOUR, unit.accelerometer_random_ug * 1e-3
    factor = settings.error_factor
    return Model(
        gyro_noise_deg_rth=factor * unit.angle_random_walk_deg_per_sqrt_h,
        accel_noise_mps_rth=factor * unit.velocity_random_walk_mps_per_sqrt_s * float(np.sqrt(HOUR)),
        gyro_walk_dps_rth=factor * gyro_dps * float(np.sqrt(2.0 * HOUR / unit.gyro_correlation_s)),
        accel_walk_mg_rth=factor * accel_mg * float(np.sqrt(2.0 * HOUR / unit.accelerometer_correlation_s)),
        position_scale=gnss.position_white_m / total / gnss.stated_factor,
        velocity_scale=1.0 / gnss.stated_factor,
        position_floor_m=0.0,
        velocity_floor_mps=0.0,
        slow_scale=gnss.position_slow_m / total / gnss.stated_factor,
        fast_scale=gnss.position_fast_m / total / gnss.stated_factor,
        slow_s=gnss.slow_s,
        fast_s=gnss.fast_s,
        jitter_s=0.0,
    )


def known_sigmas(settings: ImuSettings) -> StartSigmas:
    """Return the sigmas of the constants of a simulated log.

    Half of what turns the accelerometers against each other is a rotation of all three. The attitude is theirs, and the
    gyros are misaligned to them by so much more, two and two of them together: the variance is that of their rotation.
    """
    unit, factor = load_imu_class(settings.imu_class), settings.error_factor
    gyro = float(np.hypot(unit.gyro_constant_dph, unit.gyro_random_dph)) / HOUR
    accel = float(np.hypot(unit.accelerometer_constant_ug, unit.accelerometer_random_ug)) * 1e-3
    ppm = 1e-6 * np.array(
        [
            unit.gyro_scale_factor_ppm,
            unit.gyro_cross_axis_ppm,
            unit.accelerometer_scale_factor_ppm,
            unit.accelerometer_cross_axis_ppm,
        ]
    )
    if settings.scale_factor is not None:
        ppm[[0, 2]] = settings.scale_factor
    if settings.misalignment_deg is not None:
        ppm[[1, 3]] = np.radians(settings.misalignment_deg)
    return StartSigmas(
        gyro_bias_dps=factor * gyro,
        accel_bias_mg=factor * accel,
        gyro_scale=factor * float(ppm[0]),
        misalignment_deg=factor * float(np.degrees(np.hypot(ppm[1], ppm[3]))),
        accel_scale=factor * float(ppm[2]),
        accel_square_deg=factor * float(np.degrees(ppm[3] * np.sqrt(0.5))),
    )
