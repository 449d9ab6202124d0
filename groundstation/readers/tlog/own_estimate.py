"""The autopilot's own estimate in telemetry.

It tells whether its filter had states, and which estimator gave the attitude.

Source: ArduPilot, EKF_STATUS_REPORT of ardupilotmega.xml (EKF_UNINITIALIZED), GCS_MAVLink send_global_position_int
(velocities are zeros where the filter has none), AHRS_EKF_TYPE of AP_AHRS.h.
"""

from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, Remark
from groundstation.readers.parts import TopicPart
from groundstation.readers.tlog.canonical import OF_FILTER

STATUS = "EKF_STATUS_REPORT"
UNINITIALISED = 1024
VELOCITY = tuple(f"velocity_{axis}_mps" for axis in ("north", "east", "down"))
_NAMES = {0.0: "attitude by DCM", 10.0: "the simulator's truth"}  # by AHRS_EKF_TYPE, where it is no filter


@dataclass
class OwnEstimate:
    """State of the vehicle's filter, message by message.

    ``unready`` counts velocities that are none.
    """

    unready: int = 0
    _index: Int64Array = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    _is_unready: np.ndarray = field(default_factory=lambda: np.zeros(1, dtype=bool))
    _type: float | None = None

    def begin(self, first_index: int) -> None:
        """Begin a block of messages with the state at the end of the one before."""
        self._index, self._is_unready = np.array([first_index]), self._is_unready[-1:]

    def see(self, name: str, part: TopicPart) -> None:
        """Take in the status of the filter, and the parameter that names the estimator."""
        if name == STATUS and "flags" in part.columns:
            flags = part.columns["flags"].values.astype(np.int64)
            self._index = np.concatenate((self._index, part.index))
            self._is_unready = np.concatenate((self._is_unready, flags & UNINITIALISED != 0))
        elif name == "PARAM_VALUE":
            is_type = part.columns["param_id"].values == "AHRS_EKF_TYPE"
            if is_type.any():
                self._type = float(part.columns["param_value"].values[is_type][-1])

    def ready(self, columns: Mapping[str, Column], index: Int64Array) -> dict[str, Column]:
        """Return the columns without velocities of zero while the filter had no states."""
        kept = dict(columns)
        if not kept.keys() >= set(VELOCITY) or not self._is_unready.any():
            return kept
        place = np.searchsorted(self._index, index, side="right") - 1
        absent = self._is_unready[np.maximum(place, 0)] & np.all(
            [kept[name].values == 0.0 for name in VELOCITY], axis=0
        )
        self.unready += int(np.count_nonzero(absent))
        if absent.any():
            kept |= {name: Column(kept[name].values, kept[name].mask & ~absent) for name in VELOCITY}
        return kept

    def told(self, remark: Remark) -> Remark:
        """Return a remark with the estimator that gave the attitude in place of the filter."""
        name = _NAMES.get(self._type) if self._type is not None else None
        return remark if name is None else replace(remark, text=remark.text.replace(OF_FILTER, name))
