"""SBET records of a track with attitude, and its sigmas as SMRMSG beside it.

A record has 17 doubles; heading is from true north.

The formats are those of Applanix, POSPac MMS file formats.
"""

from pathlib import Path

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Int64Array
from groundstation.base.timescales import GPS_EPOCH_NS, leap_seconds_at
from groundstation.base.units import ARCMIN_PER_DEG, NS_PER_S
from groundstation.exports.tracks import (
    ANGLE_SIGMAS,
    EAST_SIGMA,
    ELLIPSOID,
    NORTH_SIGMA,
    VELOCITY_SIGMAS,
    VERTICAL_SIGMA,
    Track,
)
from groundstation.readers.sbet_records import ACCURACY, RECORD, S_PER_WEEK

NS_PER_DAY = 86_400 * NS_PER_S
NEEDED = (
    ELLIPSOID,
    "velocity_north_mps",
    "velocity_east_mps",
    "velocity_down_mps",
    "roll_deg",
    "pitch_deg",
    "true_heading_deg",
)

SIGMAS = (NORTH_SIGMA, EAST_SIGMA, VERTICAL_SIGMA, *VELOCITY_SIGMAS, *ANGLE_SIGMAS)  # in the order of SMRMSG


def write_sbet(path: Path, track: Track) -> int:
    """Write the positions whose altitude, attitude and velocity are known.

    The result is how many were left out. The wander angle is zero. Accelerations and rates are not in a track and stay
    zero, as SBET has no mark for what is missing. Seconds of the GPS week go on beyond its end. A file name with the
    date (sbet_20260504.out) tells the week.

    Raises
    ------
    NotAssessableError
        Without UTC, or a position of which all of these are known.
    """
    if not track.has_utc:
        raise NotAssessableError(track.name, "no UTC in this flight", "a log with absolute time")
    known = np.isfinite([track.column(name) for name in NEEDED]).all(axis=0)
    if not known.any():
        raise NotAssessableError(
            track.name, "no position with altitude above the ellipsoid, velocity and attitude", "an INS with them"
        )
    records = np.zeros(int(np.count_nonzero(known)), RECORD)
    records["time"] = _week_s(track.time_ns[known])
    records["latitude"] = np.deg2rad(track.latitude_deg[known])
    records["longitude"] = np.deg2rad(track.longitude_deg[known])
    records["altitude"], north, east, down, roll, pitch, heading = (track.column(name)[known] for name in NEEDED)
    records["x_velocity"], records["y_velocity"], records["z_velocity"] = north, east, down
    records["roll"], records["pitch"] = np.deg2rad(roll), np.deg2rad(pitch)
    records["platform_heading"] = np.deg2rad(wrap_180(heading))
    path.write_bytes(records.tobytes())
    return int(len(track) - len(records))


def write_accuracies(path: Path, track: Track) -> int:
    """Write the sigmas of the positions as SMRMSG, and return how many.

    They are those of position in metres, of velocity in m/s, both north, east, down, and of roll, pitch and heading in
    minutes of arc, of the positions of which all are known. Times are those of the SBET. No file is written where there
    are none.
    """
    placed = np.flatnonzero(np.isfinite([track.column(name) for name in NEEDED]).all(axis=0))
    sigmas = np.array([track.column(name)[placed] for name in SIGMAS])
    known = np.isfinite(sigmas).all(axis=0)
    if not track.has_utc or not known.any():
        return 0
    records = np.zeros(int(np.count_nonzero(known)), ACCURACY)
    records["time"] = _week_s(track.time_ns[placed])[known]
    for field, name, sigma in zip((ACCURACY.names or ())[1:], SIGMAS, sigmas, strict=True):
        records[field] = (ARCMIN_PER_DEG if name in ANGLE_SIGMAS else 1.0) * sigma[known]
    path.write_bytes(records.tobytes())
    return len(records)


def _week_s(time_ns: Int64Array) -> FloatArray:
    """Return seconds of the GPS week of the first of some moments, which go on beyond its end."""
    days, day = np.unique(time_ns // NS_PER_DAY, return_inverse=True)
    leap_s = np.array([leap_seconds_at(int(one) * NS_PER_DAY) for one in days])[day]  # they come at midnight
    gps_ns = time_ns - GPS_EPOCH_NS + leap_s * NS_PER_S
    week_ns = gps_ns[0] // (S_PER_WEEK * NS_PER_S) * S_PER_WEEK * NS_PER_S
    return np.asarray((gps_ns - week_ns) / NS_PER_S)
