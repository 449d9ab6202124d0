"""Parameters of an autopilot by its own log: values, defaults, changes.

A ULog has them as messages P and Q, a DataFlash log as PARM (with ``Default`` from ArduPilot 4.3 on), a telemetry log
as PARAM_VALUE, which tells no defaults.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.tables.table import Flight, Table

ULOG, DATAFLASH, MAVLINK = "raw.ulog.parameters", "raw.PARM", "raw.PARAM_VALUE"
_CONFIGURATION, _SYSTEM = "default of the configuration", "system default"
_PX4, _INTEGERS = 12.0, (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # MAV_AUTOPILOT_PX4, MAV_PARAM_TYPE_UINT8 .. INT32
_TOLERANCE = 1e-6  # relative: values and defaults are single precision


@dataclass(frozen=True)
class Parameter:
    """One parameter.

    Parameters
    ----------
    name : str
    value : float
        The last one logged.
    default : float, optional
        None where the log does not tell it.
    first : float
        The first one logged: it differs from ``value`` where somebody changed it.
    source : str
        Topic.
    """

    name: str
    value: float
    default: float | None
    first: float
    source: str

    @property
    def differs(self) -> bool:
        """Tell whether it is known to differ from its default."""
        return self.default is not None and not bool(np.isclose(self.value, self.default, _TOLERANCE, 1e-12))


@dataclass(frozen=True)
class Parameters:
    """Parameters by name; ``has_defaults`` tells whether the log says anything of defaults."""

    by_name: Mapping[str, Parameter]
    has_defaults: bool
    source: str

    def value(self, *names: str) -> float | None:
        """Return the value of the first of some names that is logged and finite; None without one."""
        for name in names:
            found = self.by_name.get(name)
            if found is not None and np.isfinite(found.value):
                return found.value
        return None

    @property
    def differing(self) -> tuple[Parameter, ...]:
        """Parameters that differ from their default, by name."""
        return tuple(self.by_name[name] for name in sorted(self.by_name) if self.by_name[name].differs)

    @property
    def changed(self) -> tuple[Parameter, ...]:
        """Parameters whose value changed while the log was recorded, by name."""
        every = (self.by_name[name] for name in sorted(self.by_name))
        return tuple(one for one in every if not np.isclose(one.value, one.first, _TOLERANCE, 1e-12, equal_nan=True))


def parameters_of(flight: Flight) -> Parameters:
    """Return the parameters that a log tells; none of them where it tells none."""
    return flight.once("parameters", _read)


def _read(flight: Flight) -> Parameters:
    for topic, read in ((ULOG, _of_ulog), (DATAFLASH, _of_dataflash), (MAVLINK, _of_mavlink)):
        if topic in flight and len(flight[topic]):
            found = read(flight, flight[topic])
            if found.by_name:
                return found
    return Parameters(MappingProxyType({}), False, "")


def _of_ulog(_flight: Flight, table: Table) -> Parameters:
    """Read P and Q messages.

    A parameter without a default in a log that has defaults is at its default (ULog file format, message Q). The
    default of the configuration (airframe) counts before that of the system.
    """
    if not _holds(table, ("name", "kind"), ("value",)):
        return Parameters(MappingProxyType({}), False, table.topic)
    name, kind, value = table.text("name"), table.text("kind"), table.values("value")
    is_default = np.char.find(kind, "default") >= 0
    has_defaults = bool(is_default.any())
    defaults: dict[str, float] = {}
    for word in (_SYSTEM, _CONFIGURATION):
        chosen = is_default & (np.char.find(kind, word) >= 0)
        defaults |= _by_name(name[chosen], value[chosen], last=True)
    plain = is_default & (kind == "default")
    defaults |= {key: one for key, one in _by_name(name[plain], value[plain], last=True).items() if key not in defaults}
    return _made(table.topic, name[~is_default], value[~is_default], defaults, has_defaults, at_default=has_defaults)


def _of_dataflash(_flight: Flight, table: Table) -> Parameters:
    if not _holds(table, ("Name",), ("Value",)):
        return Parameters(MappingProxyType({}), False, table.topic)
    name, value = table.text("Name"), table.values("Value")
    defaults: dict[str, float] = {}
    if _holds(table, (), ("Default",)):
        default = table.values("Default")
        known = np.isfinite(default)  # a parameter set in flight is logged without one
        defaults = _by_name(name[known], default[known], last=False)
    return _made(table.topic, name, value, defaults, bool(defaults), at_default=False)


def _of_mavlink(flight: Flight, table: Table) -> Parameters:
    """Read PARAM_VALUE; PX4 sends integers as the bits of a float, ArduPilot as a float."""
    if not _holds(table, ("param_id",), ("param_value",)):
        return Parameters(MappingProxyType({}), False, table.topic)
    name, value = table.text("param_id"), table.values("param_value")
    if _is_px4(flight) and _holds(table, (), ("param_type",)):
        bits = value.astype(np.float32).view(np.int32).astype(np.float64)
        value = np.where(np.isin(table.values("param_type"), _INTEGERS), bits, value)
    return _made(table.topic, name, value, {}, False, at_default=False)


def _is_px4(flight: Flight) -> bool:
    if "raw.HEARTBEAT" not in flight or not _holds(flight["raw.HEARTBEAT"], (), ("autopilot",)):
        return False
    return bool(np.median(flight["raw.HEARTBEAT"].values("autopilot")) == _PX4)


def _holds(table: Table, texts: tuple[str, ...], numbers: tuple[str, ...]) -> bool:
    """Tell whether columns are there, of the kind that is meant."""
    return all(table.has(one) and table.columns[one].values.dtype.kind == "U" for one in texts) and all(
        table.has(one) and table.columns[one].values.dtype.kind in "fiub" for one in numbers
    )


def _made(
    topic: str,
    name: NDArray[np.str_],
    value: FloatArray,
    defaults: Mapping[str, float],
    has_defaults: bool,
    *,
    at_default: bool,
) -> Parameters:
    first, last = _by_name(name, value, last=False), _by_name(name, value, last=True)
    every = {
        key: Parameter(key, one, defaults.get(key, first[key] if at_default else None), first[key], topic)
        for key, one in last.items()
        if key
    }
    return Parameters(MappingProxyType(every), has_defaults, topic)


def _by_name(name: NDArray[np.str_], value: FloatArray, *, last: bool) -> dict[str, float]:
    """Return the first or the last value of each name."""
    names, values = name.tolist(), value.tolist()
    pairs = zip(names, values, strict=True) if last else zip(reversed(names), reversed(values), strict=True)
    return dict(pairs)
