"""The estimator that flew the aircraft, as the autopilot's own log tells it.

Several filters run side by side, and one of them may be logged, compared and judged though nothing was ever steered by
it: ArduPilot's EKF before 3.3 flew a plane only with AHRS_EKF_USE = 1. Names: ``DCM``, ``EKF1``, ``EKF2``, ``EKF3``,
``external``, ``simulator`` of ArduPilot; ``PX4 EKF2``, ``PX4 LPE``, ``PX4 Q`` of PX4.

Source: ArduPilot, libraries/AP_AHRS/AP_AHRS.h (EKFType) and AP_AHRS.cpp (EKF_USE, EKF_TYPE), 4.7.0-dev of 2025-10-24
and commit 9e73155 of 2014-12-01; ATT.AEKF from 4.1 on. PX4-Autopilot, parameters SYS_MC_EST_GROUP, EKF2_EN, LPE_EN,
ATT_EN.
"""

import numpy as np

from groundstation.base.ardupilot_codes import ESTIMATORS
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.tables.parameters import Parameters, parameters_of
from groundstation.tables.table import Flight

DCM, EKF1, PX4_EKF2, PX4_LPE, PX4_Q = "DCM", "EKF1", "PX4 EKF2", "PX4 LPE", "PX4 Q"
SIMULATOR = "simulator"  # its truth stands in place of an estimate
_LOGGED = {"EKF1": ("raw.EKF1",), "EKF2": ("raw.NKF1", "raw.NKF1.0"), "EKF3": ("raw.XKF1", "raw.XKF1.0")}
_EKF_TOPICS = {"EKF": "EKF1", "NKF": "EKF2", "XKF": "EKF3"}
_PX4_GROUPS = {1: PX4_LPE, 2: PX4_EKF2, 3: PX4_Q}


@dataclass(frozen=True)
class EstimatorInUse:
    """Estimator that flew the aircraft.

    Parameters
    ----------
    name : str
        That of most of the log.
    source : str
        Field or parameter, with its value: ``AHRS_EKF_USE = 0``.
    others : tuple of str
        Filters that were logged and did not fly it.
    times_ns, names
        Where the log tells it along the flight: the time from which each name holds. Empty: ``name`` throughout.
    """

    name: str
    source: str
    others: tuple[str, ...] = ()
    times_ns: tuple[int, ...] = ()
    names: tuple[str, ...] = ()

    def flew(self, name: str) -> bool:
        """Tell whether an estimator flew the aircraft at any time."""
        return name in (self.names or (self.name,))

    def at(self, name: str, time_ns: Int64Array) -> BoolArray:
        """Tell when an estimator flew the aircraft, shape as ``time_ns``."""
        if not self.times_ns:
            return np.full(np.shape(time_ns), name == self.name)
        place = np.searchsorted(np.array(self.times_ns), time_ns, side="right") - 1
        return np.array([one == name for one in self.names])[np.maximum(place, 0)]


def estimator_in_use(flight: Flight) -> EstimatorInUse | None:
    """Return the estimator that flew the aircraft; None where the log does not tell it."""
    return flight.once("estimator in use", _found)


def filter_of_topic(topic: str) -> str:
    """Return the filter that writes a raw topic of DataFlash; empty for another topic.

    Examples
    --------
    >>> filter_of_topic("raw.XKF4.0"), filter_of_topic("raw.NKF9"), filter_of_topic("raw.GPS")
    ('EKF3', 'EKF2', '')
    """
    return _EKF_TOPICS.get(topic.removeprefix("raw.")[:3], "")


def _found(flight: Flight) -> EstimatorInUse | None:
    parameters = parameters_of(flight)
    for find in (_by_attitude, _by_ardupilot, _by_px4):
        found = find(flight, parameters)
        if found is not None:
            return found
    return None


def _by_attitude(flight: Flight, _parameters: Parameters) -> EstimatorInUse | None:
    """Read ATT.AEKF, the estimator active at each attitude."""
    if "raw.ATT" not in flight or not flight["raw.ATT"].has("AEKF"):
        return None
    table = flight["raw.ATT"]
    if table.columns["AEKF"].values.dtype.kind not in "iuf":
        return None
    active = table.values("AEKF")
    known = np.isfinite(active)
    time_ns, kind = table.time_ns[known], active[known].astype(np.int64)
    if not len(kind):
        return None
    kinds, counts = np.unique(kind, return_counts=True)
    name = _ardupilot(int(kinds[np.argmax(counts)]))
    first = np.concatenate([[0], np.flatnonzero(np.diff(kind)) + 1]) if len(kinds) > 1 else np.zeros(0, dtype=np.int64)
    names = tuple(_ardupilot(int(one)) for one in kind[first])
    shares = " and ".join(f"{one} in {count / len(kind):.0%}" for one, count in zip(kinds, counts, strict=True))
    told = f"ATT.AEKF = {shares if len(kinds) > 1 else kinds[0]}"
    return EstimatorInUse(name, told, _others(flight, names or (name,)), tuple(time_ns[first].tolist()), names)


def _by_ardupilot(flight: Flight, parameters: Parameters) -> EstimatorInUse | None:
    """Read AHRS_EKF_TYPE and AHRS_EKF_USE.

    The first alone decides since it exists without the second; a plane of 3.3 to 3.5 has both, and flies by DCM where
    the second is 0.
    """
    kind, used = parameters.value("AHRS_EKF_TYPE"), parameters.value("AHRS_EKF_USE")
    if used is not None and used == 0.0:
        return EstimatorInUse(DCM, "AHRS_EKF_USE = 0", _others(flight, (DCM,)))
    if kind is not None:
        name = _ardupilot(int(kind))
        return EstimatorInUse(name, f"AHRS_EKF_TYPE = {kind:g}", _others(flight, (name,)))
    if used is not None:
        return EstimatorInUse(EKF1, f"AHRS_EKF_USE = {used:g}", _others(flight, (EKF1,)))
    return None


def _by_px4(_flight: Flight, parameters: Parameters) -> EstimatorInUse | None:
    """Read EKF2_EN, LPE_EN and ATT_EN, or SYS_MC_EST_GROUP of older firmware."""
    if parameters.value("EKF2_EN") == 1.0:
        return EstimatorInUse(PX4_EKF2, "EKF2_EN = 1")
    if parameters.value("LPE_EN") == 1.0:
        return EstimatorInUse(PX4_LPE, "LPE_EN = 1")
    if parameters.value("ATT_EN") == 1.0:
        return EstimatorInUse(PX4_Q, "ATT_EN = 1")
    group = parameters.value("SYS_MC_EST_GROUP")
    if group is not None and int(group) in _PX4_GROUPS:
        return EstimatorInUse(_PX4_GROUPS[int(group)], f"SYS_MC_EST_GROUP = {group:g}")
    return None


def _ardupilot(kind: int) -> str:
    return ESTIMATORS.get(kind, f"estimator {kind}")


def _others(flight: Flight, names: tuple[str, ...]) -> tuple[str, ...]:
    """Filters that are logged besides those in use."""
    logged = [name for name, topics in _LOGGED.items() if any(topic in flight for topic in topics)]
    return tuple(name for name in logged if name not in names)
