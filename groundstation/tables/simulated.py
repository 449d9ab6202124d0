"""Simulator that made a log: no aircraft flew, and its sensors are models.

Source: ArduPilot, SIM and SIM2 of DataFlash and SIMSTATE of MAVLink (libraries/SITL, written by the simulator alone),
AHRS_EKF_TYPE 10 (AP_AHRS.h); MAVLink common.xml, SIM_STATE and MAV_MODE_FLAG_HIL_ENABLED; PX4-Autopilot, hardware
PX4_SITL, vehicle_status.hil_state and the topics of ground truth, which only simulators publish.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.tables.parameters import parameters_of
from groundstation.tables.table import Flight

CODE = "vehicle.simulated"  # code of the finding
TOPICS = (
    *("SIMSTATE", "SIM_STATE", "SIM", "SIM2"),
    *("vehicle_attitude_groundtruth", "vehicle_local_position_groundtruth", "vehicle_global_position_groundtruth"),
)
HARDWARE = ("ver_hw", "hardware")  # what the head of a ULog says of it
HIL_ENABLED = 32  # MAV_MODE_FLAG of HEARTBEAT.base_mode
SIMULATOR = 10.0  # AHRS_EKF_TYPE


def simulated_by(flight: Flight) -> str:
    """Return what tells that a simulator made the log; empty where nothing does."""
    return flight.once("simulator", _found)


def _found(flight: Flight) -> str:
    for name in HARDWARE:
        if "SITL" in flight.metadata.get(name, "").upper():
            return f"{name} {flight.metadata[name]}"
    for name in TOPICS:
        topic = f"raw.{name}"
        if any(one == topic or one.startswith(f"{topic}.") for one in flight.topics() if len(flight[one])):
            return name
    if np.any(_numbers(flight, "raw.HEARTBEAT", "base_mode").astype(np.int64) & HIL_ENABLED):
        return "HEARTBEAT: hardware in the loop"
    if np.any(_numbers(flight, "raw.vehicle_status", "hil_state") > 0.0):
        return "vehicle_status.hil_state"
    return "AHRS_EKF_TYPE = 10" if parameters_of(flight).value("AHRS_EKF_TYPE") == SIMULATOR else ""


def _numbers(flight: Flight, topic: str, name: str) -> NDArray[np.float64]:
    if topic not in flight or not flight[topic].has(name):
        return np.zeros(0)
    if flight[topic].columns[name].values.dtype.kind not in "biuf":
        return np.zeros(0)
    values = flight[topic].values(name)
    return values[np.isfinite(values)]
