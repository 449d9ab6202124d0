"""Classes of inertial units: error budgets of gyros and accelerometers.

They ship as TOML beside this module, one file a class."""

from dataclasses import fields
from functools import cache
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import number, required_number, settings_from
from groundstation.simulation.ins_class import load_ins_class

_CLASSES = ShippedToml("groundstation.simulation.imu", "imu_classes", "imu_class")


@dataclass(frozen=True)
class ImuClass:
    """Error budget of a raw inertial unit.

    Every number is a sigma per axis unless it says otherwise. Constants are drawn at turn-on; ``gyro_random`` and
    ``accelerometer_random`` are first-order Gauss-Markov processes. ``rate_resolution_dps`` and
    ``acceleration_resolution_mps2`` are steps of the output, 0 for none. A file that names an ``ins_class`` has the
    sensors of that class.
    """

    gyro_constant_dph: float = required_number(0.0, 100_000.0)
    name: str = ""
    title: str = ""
    gyro_random_dph: float = number(0.0, 0.0, 10_000.0)
    gyro_correlation_s: float = number(300.0, 1.0, 1e6)
    angle_random_walk_deg_per_sqrt_h: float = number(0.0, 0.0, 100.0)
    gyro_scale_factor_ppm: float = number(0.0, 0.0, 1e5)
    gyro_cross_axis_ppm: float = number(0.0, 0.0, 1e5)
    accelerometer_constant_ug: float = number(0.0, 0.0, 1e6)
    accelerometer_random_ug: float = number(0.0, 0.0, 1e6)
    accelerometer_correlation_s: float = number(300.0, 1.0, 1e6)
    velocity_random_walk_mps_per_sqrt_s: float = number(0.0, 0.0, 10.0)
    accelerometer_scale_factor_ppm: float = number(0.0, 0.0, 1e5)
    accelerometer_cross_axis_ppm: float = number(0.0, 0.0, 1e5)
    rate_resolution_dps: float = number(0.0, 0.0, 10.0)
    acceleration_resolution_mps2: float = number(0.0, 0.0, 10.0)


def imu_class_names() -> tuple[str, ...]:
    """Names of the shipped classes, in alphabetical order.

    Examples
    --------
    >>> imu_class_names()
    ('consumer', 'mems', 'navigation', 'tactical')
    """
    return _CLASSES.names()


@cache
def load_imu_class(name: str) -> ImuClass:
    """Load a shipped class of inertial units, or one of the user's (a file ``*.toml``).

    Raises
    ------
    SettingsError
        When there is no such class, or its file holds what cannot be used.

    Examples
    --------
    >>> load_imu_class("tactical").gyro_constant_dph
    1.0
    """
    file = _CLASSES.read(name)
    table: dict[str, Any] = {"name": file.name} | file.table
    sensors = table.pop("ins_class", None)
    if sensors is not None:
        ins = load_ins_class(str(sensors))
        shared = {item.name for item in fields(ImuClass)} & {item.name for item in fields(ins)} - {"name", "title"}
        table = {name: getattr(ins, name) for name in shared} | table
    return settings_from(ImuClass, table, file.where)
