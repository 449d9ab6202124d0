"""Shortfalls of a log for a best trajectory, and what its recorder can log instead."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.systems.analysis import Shortfall
from groundstation.systems.known import Known
from groundstation.systems.trajectory.gather import gather
from groundstation.systems.trajectory.imu_samples import SUBJECT
from groundstation.systems.trajectory.settings import TrajectorySettings
from groundstation.systems.trajectory.solve import aids_beside, mounting_of, require_enough
from groundstation.tables.table import Flight

ENOUGH_HZ = 1.0  # of GNSS


class Recorder(NamedTuple):
    """A kind of log, what to log in it of the inertial unit, and of GNSS velocity."""

    name: str
    wrote: Callable[[Flight], bool]
    imu: str
    velocity: str = ""


def _any_topic(*begins: str) -> Callable[[Flight], bool]:
    return lambda flight: any(topic.startswith(begins) for topic in flight.topics())


def _is_px4(flight: Flight) -> bool:
    return flight.metadata.get("sys_name") == "PX4" or _any_topic("raw.ulog.")(flight)


def _is_ros(flight: Flight) -> bool:
    """Tell whether a log is a bag: its topics have types, or names with a slash."""
    has_types = any(key.startswith("type.raw.") and "/" in text for key, text in flight.metadata.items())
    return has_types or any(topic.startswith("raw.") and "/" in topic for topic in flight.topics())


RECORDERS: tuple[Recorder, ...] = (
    Recorder(
        "PX4",
        _is_px4,
        "set bit 1 of SDLOG_PROFILE (estimator replay; 3 with the default set): it logs sensor_combined at its full "
        "rate, with integration times; the default set has vehicle_imu at 2 Hz alone",
    ),
    Recorder(
        "ArduPilot",
        _any_topic("raw.FMT"),
        "add 524288 (bit 19, raw IMU) to LOG_BITMASK, on a Copter or 262144 (bit 18, fast IMU, 400 Hz), and let no "
        "LOG_FILE_RATEMAX thin it; IMT, where the version has it, is best; batches of INS_LOG_BAT_MASK have gaps and "
        "do not serve",
    ),
    Recorder(
        "MAVLink telemetry",
        _any_topic("raw.HEARTBEAT"),
        "take the log on board (.ulg or .bin): telemetry has too few samples",
    ),
    Recorder(
        "ROS",
        _is_ros,
        "record sensor_msgs/Imu of the unit's driver with angular velocity and acceleration (a covariance of -1 says "
        "that they are absent), at its full rate",
        "record the receiver's velocity (TwistStamped, NavPVT or Odometry)",
    ),
    Recorder(
        "u-blox",
        _any_topic("raw.NAV-", "raw.RXM-", "raw.ESF-"),
        "enable UBX-ESF-RAW, or UBX-ESF-MEAS, of a receiver with an inertial unit; else log a unit beside it",
        "enable UBX-NAV-PVT",
    ),
    Recorder(
        "NovAtel",
        _any_topic("raw.BEST", "raw.INSPVA"),
        "log RAWIMUSXB ONNEW; CORRIMUDATA, which has gravity taken off, and RAWIMU, which does not "
        "tell its scale, do not serve",
        "log BESTVELB ONTIME 0.2",
    ),
)
COCKPIT = Recorder(
    "cockpit recorder",
    _any_topic("raw.g1000", "raw.g3x", "raw.g5", "raw.skyview", "raw.avidyne"),
    "a cockpit recorder keeps no rates and no specific force: carry a recorder with an inertial unit at 100 Hz or more "
    "and a receiver of its own",
)
RECORDERS = (*RECORDERS, COCKPIT)
ANY = Recorder(
    "",
    lambda _: True,
    "log increments of three gyros and three accelerometers, or samples at 100 Hz or more",
    "log the receiver's velocity north, east and down",
)


def recorder_of(flight: Flight) -> Recorder:
    """Return the kind of log that a flight is from."""
    return next((one for one in RECORDERS if one.wrote(flight)), ANY)


def examine_trajectory(flight: Flight, known: Known, settings: TrajectorySettings) -> tuple[Shortfall, ...]:
    """Report what a log lacks for a trajectory that is accepted, before anything is estimated.

    Raises
    ------
    NotAssessableError
        Where there would be none, with the reason that the estimate would give, and what to log.
    """
    recorder = recorder_of(flight)
    with advised(flight):
        gathered = gather(flight, known, settings.input)
        mounting = mounting_of(flight, known, gathered, settings)
        require_enough(gathered, settings)
    facts, found = gathered.imu_facts, []
    if not facts.is_integral and facts.rate_hz < settings.sample_rate_doubt_hz:
        text = f"point samples of {facts.rate_hz:.0f} Hz, {settings.sample_rate_doubt_hz:g} Hz or increments are needed"
        found.append(Shortfall(f"{text}: {recorder.imu}"))
    velocity = np.isfinite(gathered.gnss.velocity_mps)
    if not velocity[:, :2].any():
        found.append(Shortfall(f"no GNSS velocity in the log: {recorder.velocity or ANY.velocity}"))
    elif not velocity[:, 2].any():
        found.append(Shortfall("no vertical velocity of GNSS"))
    if gathered.gnss_facts.rate_hz < 0.9 * ENOUGH_HZ:
        found.append(Shortfall(f"GNSS at {gathered.gnss_facts.rate_hz:.2g} Hz, {ENOUGH_HZ:g} Hz or more is needed"))
    found += [Shortfall(note.text) for note in gathered.notes if note.is_doubt]
    if mounting.source == "case":
        text = "mounting of the unit not known: the attitude is that of its case, and no error of the filter on board"
        found.append(Shortfall(f"{text} is told; state imu_mounting_deg in the aircraft file"))
    elif mounting.doubt:
        found.append(Shortfall(mounting.doubt))
    aids = aids_beside(flight, known, gathered, mounting, settings)
    found += [Shortfall(f"{one.topic}: {one.name} does not aid: {one.reason}") for one in aids.rows if one.is_wrong]
    return tuple(found)


@contextmanager
def advised(flight: Flight) -> Iterator[None]:
    """Add to a reason what to log, where the inertial unit is the reason."""
    try:
        yield
    except NotAssessableError as error:
        is_absent = not topics_of_kind("imu", flight.topics())
        is_unit = is_absent or "point samples" in error.found or "no unit with three gyros" in error.found
        if error.next_step or not is_unit:
            raise
        raise NotAssessableError(SUBJECT, error.found, error.expected, recorder_of(flight).imu) from error
