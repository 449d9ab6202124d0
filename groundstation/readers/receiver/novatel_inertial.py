"""Topic ``imu`` from NovAtel's increments of an inertial unit, RAWIMUX and RAWIMUSX.

Their counts are scaled by the type of the unit, which the messages state; RAWIMU and RAWIMUS do not and stay raw. Axes
are the unit's own: x right, y forward, z up of its case become forward y, right x, down -z. The rotation from the case
to the vehicle is not applied.

Source: NovAtel, OEM7 commands and logs reference manual, RAWIMUSX: fields, signs, table of raw IMU scale factors, whose
values are those of NovAtel's own driver (novatel_oem7_driver, MIT, oem7_imu.cpp); types as in the database of
novatel_edie (MIT). The manual's example of an EPSON G320N (type 41) gives 9.86 m/s2 upward.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import RecordBatch
from groundstation.base.units import DEG_PER_RAD, M_PER_FOOT, MPS2_PER_G
from groundstation.readers import imu
from groundstation.readers.receiver.messages import MessagesByName
from groundstation.readers.receiver.novatel import TimedMessages, solution_time

SOURCES = ("RAWIMUSX", "RAWIMUX")  # of both the one with more messages
UNSCALED = ("RAWIMU", "RAWIMUS")
_IMU_ERROR, _ENCRYPTED = 1, 2  # bits of imu_status_info: the counts are none
_ARCSECOND_RAD = 1.0 / (3_600.0 * DEG_PER_RAD)


class UnitScale(NamedTuple):
    """Name of a unit, and its radians and metres per second of a count."""

    name: str
    rad: float
    mps: float


def _epson(name: str, dps: float, thousandths_g: float, rate_hz: float) -> UnitScale:
    """Return the scale of a unit whose counts are rates: over a sample of its own rate."""
    counts = 65_536.0 * rate_hz
    return UnitScale(name, dps / DEG_PER_RAD / counts, 1e-3 * thousandths_g * MPS2_PER_G / counts)


_HONEYWELL = 2.0**-33
SCALES: Mapping[int, UnitScale] = MappingProxyType(
    {
        1: UnitScale("HG1700 AG11", _HONEYWELL, 2.0**-27 * M_PER_FOOT),
        4: UnitScale("HG1700 AG17", _HONEYWELL, 2.0**-26 * M_PER_FOOT),
        5: UnitScale("HG1900 CA29", _HONEYWELL, 2.0**-27 * M_PER_FOOT),
        8: UnitScale("LN-200", 2.0**-19, 2.0**-14),
        11: UnitScale("HG1700 AG58", _HONEYWELL, 2.0**-27 * M_PER_FOOT),
        12: UnitScale("HG1700 AG62", _HONEYWELL, 2.0**-26 * M_PER_FOOT),
        13: UnitScale("iIMU-FSAS", 0.1 * 2.0**-8 * _ARCSECOND_RAD, 0.05 * 2.0**-15),
        16: UnitScale("KVH CPT", 0.1 / (3_600.0 * 256.0), 0.05 * 2.0**-15),
        20: UnitScale("HG1930 AA99", _HONEYWELL, 2.0**-27 * M_PER_FOOT),
        26: UnitScale("ISA-100C", 1e-9, 2e-8),
        27: UnitScale("HG1900 CA50", _HONEYWELL, 2.0**-27 * M_PER_FOOT),
        28: UnitScale("HG1930 CA50", _HONEYWELL, 2.0**-27 * M_PER_FOOT),
        31: UnitScale("ADIS16488", 720.0 * 2.0**-31 / DEG_PER_RAD, 200.0 * 2.0**-31),
        32: UnitScale("STIM300", 2.0**-21 / DEG_PER_RAD, 2.0**-22),
        33: UnitScale("KVH 1750", 0.1 / (3_600.0 * 256.0), 0.05 * 2.0**-15),
        41: _epson("EPSON G320N", 0.008, 0.2, 125.0),
        52: UnitScale("microIMU", 1e-9, 2e-8),
        56: UnitScale("STIM300D", 2.0**-21 / DEG_PER_RAD, 2.0**-22),
        58: UnitScale("HG4930 AN01", _HONEYWELL, 2.0**-29),
        61: _epson("EPSON G370N", 0.0151515, 0.4, 200.0),
        62: _epson("EPSON G320N, 200 Hz", 0.008, 0.2, 200.0),
        68: UnitScale("HG4930 AN04", _HONEYWELL, 2.0**-29),
        69: UnitScale("HG4930 AN04, 400 Hz", _HONEYWELL, 2.0**-29),
    }
)


def _by_type(place: int) -> FloatArray:
    table = np.full(256, np.nan)
    for kind, scale in SCALES.items():
        table[kind] = (scale.rad, scale.mps)[place]
    return table


_RAD, _MPS = _by_type(0), _by_type(1)


def imu_batch(block: MessagesByName, source: str) -> RecordBatch | None:
    """Return one row for each message with counts of a known unit; None where none has."""
    messages, fields = block.get(source), block.fields(source)
    if not isinstance(messages, TimedMessages) or fields is None:
        return None
    kinds, told = fields["imu_type"], fields["imu_status_info"]
    known = np.isfinite(_RAD[kinds]) & (told & (_IMU_ERROR | _ENCRYPTED) == 0)
    if not known.any():
        return None

    def along(what: str, scale: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        x, minus_y, z = (fields[f"{what}_{axis}"].astype(np.float64) * scale for axis in "xyz")
        return -minus_y, x, -z

    columns = imu.integrals(along("del_ang_body", _RAD[kinds]), along("del_vel_body", _MPS[kinds]))
    return RecordBatch("imu", messages.places, solution_time(messages, fields), columns).take(known)
