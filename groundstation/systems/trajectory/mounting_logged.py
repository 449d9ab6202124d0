"""Mounting that the log of an autopilot tells: its samples are in body axes already.

PX4 turns the values of its drivers by SENS_BOARD_ROT and then by SENS_BOARD_X_OFF, Y_OFF and Z_OFF; vehicle_imu,
sensor_combined, vehicle_angular_velocity and vehicle_acceleration have the turned values, and so have HIGHRES_IMU,
SCALED_IMU and RAW_IMU on its telemetry. ArduPilot turns every sample by AHRS_ORIENTATION before IMU, IMT, ACC and GYR
are logged and sent, but not by AHRS_TRIM_X, Y and Z: these stand between the axes of the autopilot and those of the
vehicle, whose attitude it logs. None of the board rotations may be applied again; the trim is.

Sources, read 2026-11-26: PX4-Autopilot, src/lib/sensor_calibration/Accelerometer.cpp and Gyroscope.cpp (set_rotation:
"always apply board level adjustments"), msg/VehicleImu.msg ("in the FRD body frame"), and before 1.11
src/modules/sensors/vehicle_angular_velocity (board_rotation_offset * board_rotation). ArduPilot, AP_InertialSensor
(AP_InertialSensor_Backend.cpp, _rotate_and_correct_accel: "rotate to body frame") and AP_AHRS (AP_AHRS.cpp,
_rotation_autopilot_body_to_vehicle_body.from_euler of the trim).
"""

import numpy as np

from groundstation.systems.trajectory.axis_turns import from_angles
from groundstation.systems.trajectory.mounting import LoggedMounting
from groundstation.tables.parameters import Parameters, parameters_of
from groundstation.tables.table import Flight

PX4_TOPICS = ("raw.vehicle_imu", "raw.sensor_combined", "raw.vehicle_acceleration")
TURNED = "the autopilot turns its samples into body axes"
BOARD = ("SENS_BOARD_ROT", "SENS_BOARD_X_OFF", "SENS_BOARD_Y_OFF", "SENS_BOARD_Z_OFF")
TRIM = ("AHRS_TRIM_X", "AHRS_TRIM_Y", "AHRS_TRIM_Z")


def logged_mounting(flight: Flight) -> LoggedMounting | None:
    """Return the mounting of the samples of ``imu``; None where no autopilot logged them."""
    parameters = parameters_of(flight)
    if (found := parameters.value("SENS_BOARD_ROT")) is not None:
        return LoggedMounting(np.eye(3), f"{TURNED} (SENS_BOARD_ROT {found:.0f}{_level(parameters)})")
    if (found := parameters.value("AHRS_ORIENTATION")) is not None:
        return _ardupilot(parameters, found)
    if any(topic.startswith(PX4_TOPICS) for topic in flight.topics()):
        return LoggedMounting(np.eye(3), f"{TURNED} (PX4)")
    return None


def _level(parameters: Parameters) -> str:
    """Return PX4's fine turn, where there is one."""
    values = [parameters.value(name) or 0.0 for name in BOARD[1:]]
    return ", fine {:.1f}, {:.1f}, {:.1f} deg".format(*values) if any(abs(one) >= 0.05 for one in values) else ""


def _ardupilot(parameters: Parameters, orientation: float) -> LoggedMounting:
    trim_deg = np.rad2deg([parameters.value(name) or 0.0 for name in TRIM])
    told = "" if not np.any(np.abs(trim_deg) >= 0.005) else ", trim {:.2f}, {:.2f}, {:.2f} deg".format(*trim_deg)
    return LoggedMounting(from_angles(trim_deg), f"{TURNED} (AHRS_ORIENTATION {orientation:.0f}{told})")
