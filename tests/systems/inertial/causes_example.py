"""Errors by cause of one made flight: legs and turns, a tilt and a bias that are known."""

from functools import cache

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.methods.ins_noise import load_class
from groundstation.simulation.ins_draw import MICRO_G
from groundstation.simulation.ins_errors import InsErrors, SensorErrors, propagate
from groundstation.simulation.routes import Route, draw_route
from groundstation.systems.inertial.cause_answer import CausesResult
from groundstation.systems.inertial.causes import assess_causes
from groundstation.systems.inertial.differences import InsDifferences, drag_per_s
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, run_filter
from groundstation.systems.inertial.model import ChannelModel

SECONDS = 5400
ARCSEC = float(np.deg2rad(1.0 / 3600.0))
TILT_ARCSEC, BIAS_UG, DRIFT_DPH = 30.0, 40.0, 0.005  # tilt north, accelerometer right, gyro forward


@cache
def route(kind: str = "racetrack", seconds: int = SECONDS) -> Route:
    return draw_route(kind, np.arange(float(seconds)), np.random.default_rng(3))  # type: ignore[arg-type]


def errors(flown: Route, *, tilt_arcsec: float = 0.0, bias_ug: float = 0.0, drift_dph: float = 0.0) -> InsErrors:
    """Errors by a tilt north, an accelerometer bias right, and a gyro drift about the nose."""
    n = len(flown.motion.time_s)
    none = SensorErrors.none(1, n)
    tilt, bias, drift = np.zeros((1, 2)), np.zeros((1, n, 3)), np.zeros((1, n, 3))
    tilt[0, 0], bias[..., 1], drift[..., 0] = tilt_arcsec * ARCSEC, bias_ug * MICRO_G, np.deg2rad(drift_dph / 3600.0)
    names = ("gyro_white_radps", "gyro_scale", "accelerometer_scale", "deflection_mps2")
    kept = {name: getattr(none, name) for name in (*names, "position_m", "velocity_mps", "azimuth_rad")}
    return propagate(flown.motion, SensorErrors(tilt_rad=tilt, accelerometer_mps2=bias, gyro_radps=drift, **kept))


def compared(flown: Route, made: InsErrors, *, noise: float = 0.0) -> InsDifferences:
    """INS less GNSS with a receiver of ``noise`` m and a hundredth of it in m/s."""
    motion = flown.motion
    rng, n = np.random.default_rng(4), len(motion.time_s)
    ground: FloatArray = np.stack([motion.velocity_north_mps[0], motion.velocity_east_mps[0]], axis=1)
    epochs = DifferenceEpochs(
        motion.time_s,
        made.position_m[0] + noise * rng.standard_normal((n, 2)),
        made.velocity_mps[0] + 0.01 * noise * rng.standard_normal((n, 2)),
        drag_per_s(motion.latitude_deg[0], motion.altitude_m[0], ground),
        np.zeros(n, dtype=bool),
    )
    place = (motion.latitude_deg[0], flown.longitude_deg, motion.altitude_m[0])
    return InsDifferences("ins", "gnss", epochs, *place, ground, 0.0, (), motion.heading_deg[0])


def filtered(differences: InsDifferences, ins_class: str = "navigation") -> ChannelsRun:
    noise = load_class(ins_class)
    latitude = float(np.nanmean(differences.latitude_deg))
    return run_filter(differences.epochs, ChannelModel.at(latitude, 9000.0, noise.beta_per_s), noise)


@cache
def causes() -> CausesResult:
    made = errors(route(), tilt_arcsec=TILT_ARCSEC, bias_ug=BIAS_UG, drift_dph=DRIFT_DPH)
    differences = compared(route(), made, noise=2.0)
    return assess_causes(differences, filtered(differences), 0.0)
