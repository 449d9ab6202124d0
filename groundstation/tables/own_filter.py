"""GNSS innovations that an autopilot's own filter logged, in one form for all autopilots.

Autopilots log predicted - measured; here it is turned round: innovation = measured - predicted.
Source: PX4-Autopilot, EKF2, messages EstimatorInnovations and ekf2_innovations; ArduPilot, AP_NavEKF and AP_NavEKF2/3,
log messages EKF3/EKF4, NKF3/NKF4 and XKF3/XKF4 (innovations in m and m/s; SP, SV: square roots of the test ratios).
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.tables.resample import values_at
from groundstation.tables.table import Flight, Table

Names = tuple[str, ...]
QUANTITIES = ("position", "velocity")
JOINED_S = 1.0  # between two messages of one filter about the same epoch


@dataclass(frozen=True)
class _Layout:
    """Names under which a filter logs: position north and east, then velocity.

    Gates hold the square root of each test ratio.
    """

    topic: str
    innovations: Names
    variance_topic: str = ""
    variances: Names = ()
    gate_topic: str = ""
    gates: Names = ()


_PX4 = ("gps_hpos[0]", "gps_hpos[1]", "gps_hvel[0]", "gps_hvel[1]")
_LAYOUTS = (
    _Layout("raw.estimator_innovations", _PX4, "raw.estimator_innovation_variances", _PX4),
    _Layout(
        "raw.ekf2_innovations",
        tuple(f"vel_pos_innov[{place}]" for place in (3, 4, 0, 1)),
        "raw.ekf2_innovations",
        tuple(f"vel_pos_innov_var[{place}]" for place in (3, 4, 0, 1)),
    ),
    *(
        _Layout(f"raw.{name}3", ("IPN", "IPE", "IVN", "IVE"), gate_topic=f"raw.{name}4", gates=("SP", "SP", "SV", "SV"))
        for name in ("XKF", "NKF", "EKF")
    ),
)


@dataclass(frozen=True)
class OwnInnovations:
    """Innovations of an autopilot's filter against GNSS, shape (n, 2, 2).

    They are of position and velocity, north and east.

    Parameters
    ----------
    topic : str
    time_ns : ndarray of int64, shape (n,)
    innovation : ndarray, shape (n, 2, 2)
        Measured - predicted, metres and m/s; NaN where the filter used no GNSS.
    variance : ndarray, shape (n, 2, 2)
        The filter's own, m^2 and m^2/s^2; NaN where it logs none.
    gate_ratio : ndarray, shape (n, 2, 2)
        Innovation over the filter's gate, above 1 where it rejected GNSS; NaN where it logs none.
    """

    topic: str
    time_ns: Int64Array
    innovation: FloatArray
    variance: FloatArray
    gate_ratio: FloatArray

    def __post_init__(self) -> None:
        for name in ("time_ns", "innovation", "variance", "gate_ratio"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def own_innovations(flight: Flight) -> OwnInnovations | None:
    """Read the innovations that the autopilot's own filter logged; None where there are none.

    Where there are several filters, the first one is read.
    """
    for layout in _LAYOUTS:
        if layout.topic in flight and flight[layout.topic].has(*layout.innovations):
            found = _read(flight, layout)
            if np.isfinite(found.innovation).any():
                return found
    return None


def _read(flight: Flight, layout: _Layout) -> OwnInnovations:
    table = _first_core(flight[layout.topic]).unique_times()
    innovation = -_values(table, layout.innovations)
    variance, gate = (
        _at(flight, topic, names, table.time_ns)
        for topic, names in ((layout.variance_topic, layout.variances), (layout.gate_topic, layout.gates))
    )
    idle = np.all(innovation == 0.0, axis=2, keepdims=True) | (variance == 0.0)  # both are how GNSS unused is logged
    return OwnInnovations(table.topic, table.time_ns, np.where(idle, np.nan, innovation), variance, gate)


def _first_core(table: Table) -> Table:
    """The rows of one of several filters that run side by side (field ``C``)."""
    if "C" not in table or not len(table):
        return table
    core = table.values("C")
    return table.take(core == np.nanmin(core)) if np.isfinite(core).any() else table


def _at(flight: Flight, topic: str, names: Names, time_ns: Int64Array) -> FloatArray:
    if topic not in flight:
        return np.full((len(time_ns), 2, 2), np.nan)
    table = _first_core(flight[topic]).unique_times()
    columns = [values_at(table, name, time_ns, largest_gap_s=JOINED_S) for name in names]
    return np.stack(columns, axis=1).reshape(-1, 2, 2)


def _values(table: Table, names: Names) -> FloatArray:
    return np.stack([table.values(name) for name in names], axis=1).reshape(-1, 2, 2)
