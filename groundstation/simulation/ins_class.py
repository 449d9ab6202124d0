"""INS classes: error budgets of inertial navigators.

They ship as TOML beside this module, one file a class.
"""

from dataclasses import field, replace
from functools import cache
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import number, required_number, settings_from

_CLASSES = ShippedToml("groundstation.simulation", "ins_classes", "ins_class")


@dataclass(frozen=True)
class HeadingWander:
    """Error of the heading output beside the azimuth error proper.

    It wanders in straight flight and is pulled back by turns. ``offset_deg`` is the sigma of a constant;
    ``drift_deg_per_sqrt_h`` the size of the random walk; ``turn_deg`` the angle turned (either way) that takes it back
    by a factor e.
    """

    offset_deg: float = number(0.0, 0.0, 5.0)
    drift_deg_per_sqrt_h: float = number(0.0, 0.0, 5.0)
    turn_deg: float = number(60.0, 1.0, 3600.0)


@dataclass(frozen=True)
class InsClass:
    """Error budget of one class of INS.

    Every number is a sigma per axis unless it says otherwise. ``gyro_random`` and ``accelerometer_random`` are
    first-order Gauss-Markov processes. ``is_strapdown``: errors are fixed to the body, else to a platform slaved to
    north. ``is_levelled``: at the start the tilts are those that balance the accelerometer biases, as levelling on the
    ground leaves them; ``is_gyrocompassed``: the azimuth error balances the east gyro likewise. ``initial_tilt_rad``
    and ``initial_azimuth_deg`` come on top.
    """

    gyro_constant_dph: float = required_number(0.0, 10_000.0)
    name: str = ""
    title: str = ""
    is_strapdown: bool = True
    is_levelled: bool = True
    is_gyrocompassed: bool = True
    gyro_trend_dph_per_h: float = number(0.0, 0.0, 10_000.0)
    gyro_random_dph: float = number(0.0, 0.0, 10_000.0)
    gyro_correlation_s: float = number(3600.0, 1.0, 1e6)
    angle_random_walk_deg_per_sqrt_h: float = number(0.0, 0.0, 100.0)
    gyro_scale_factor_ppm: float = number(0.0, 0.0, 1e5)
    gyro_cross_axis_ppm: float = number(0.0, 0.0, 1e5)
    accelerometer_constant_ug: float = number(0.0, 0.0, 1e6)
    accelerometer_random_ug: float = number(0.0, 0.0, 1e6)
    accelerometer_correlation_s: float = number(3600.0, 1.0, 1e6)
    velocity_random_walk_mps_per_sqrt_s: float = number(0.0, 0.0, 10.0)
    accelerometer_scale_factor_ppm: float = number(0.0, 0.0, 1e5)
    accelerometer_cross_axis_ppm: float = number(0.0, 0.0, 1e5)
    deflection_arcsec: float = number(5.0, 0.0, 60.0)
    deflection_correlation_km: float = number(40.0, 0.1, 1e4)
    initial_position_m: float = number(5.0, 0.0, 1e5)
    initial_velocity_mps: float = number(0.05, 0.0, 100.0)
    initial_tilt_rad: float = number(1e-5, 0.0, 0.1)
    initial_azimuth_deg: float = number(0.0, 0.0, 45.0)
    heading: HeadingWander = field(default_factory=HeadingWander)


# Factors between which the error budget of one instrument of a class lies; log-uniform, drawn each by itself.
INSTRUMENT_SPREAD = {
    "gyro_constant_dph": (0.15, 1.5),  # low: an alignment that has learnt most of it
    "gyro_trend_dph_per_h": (0.15, 1.5),
    "gyro_random_dph": (0.3, 1.5),
    "gyro_correlation_s": (0.5, 4.0),
    "angle_random_walk_deg_per_sqrt_h": (0.5, 1.5),
    "accelerometer_constant_ug": (0.3, 1.5),
    "accelerometer_random_ug": (0.3, 1.5),
    "deflection_arcsec": (0.3, 1.5),
}


def draw_instrument(ins: InsClass, rng: np.random.Generator) -> InsClass:
    """Draw one instrument of a class.

    Its error budget is the class's times factors of :data:`INSTRUMENT_SPREAD`.
    """
    drawn: dict[str, Any] = {
        name: float(getattr(ins, name)) * float(np.exp(rng.uniform(*np.log(ends))))
        for name, ends in INSTRUMENT_SPREAD.items()
    }
    return replace(ins, **drawn)


def ins_class_names() -> tuple[str, ...]:
    """Names of the shipped classes, in alphabetical order.

    Examples
    --------
    >>> ins_class_names()
    ('i-21', 'mems', 'navigation', 'tactical')
    """
    return _CLASSES.names()


@cache
def load_ins_class(name: str) -> InsClass:
    """Load a shipped INS class, or one of the user's (a file ``*.toml``).

    Raises
    ------
    SettingsError
        When there is no such class, or its file holds what cannot be used.

    Examples
    --------
    >>> load_ins_class("i-21").gyro_constant_dph
    0.01
    """
    file = _CLASSES.read(name)
    return settings_from(InsClass, {"name": file.name} | file.table, file.where)
