"""Log of an inertial unit as ArduPilot writes it: DataFlash.

Increments are in IMT, samples in IMU, fixes in GPS and GPA, the barometer in BARO.

Source: ArduPilot 4.5, libraries/AP_Logger/LogStructure.h and libraries/AP_GPS/LogStructure.h.
"""

from pathlib import Path

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.base.timescales import GPS_EPOCH_NS
from groundstation.base.units import NS_PER_S
from groundstation.simulation.imu.aids import pressure_pa
from groundstation.simulation.imu.flight import ImuFlight
from groundstation.simulation.imu.packed import Packed, joined, records
from groundstation.simulation.imu.scenario import ImuScenario
from groundstation.simulation.imu.tables import nanoseconds

MAGIC = 0x95A3
BOOT_US = 5_000_000
LEAP_NS, WEEK_NS = 18 * NS_PER_S, 604_800 * NS_PER_S
_KINDS = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "Q": "<u8", "f": "<f4"}
_KINDS |= {"d": "<f8", "n": "S4", "N": "S16", "Z": "S64", "c": "<i2", "C": "<u2", "e": "<i4", "E": "<u4", "L": "<i4"}
_KINDS |= {"M": "u1"}
# Number, name, types, labels, units, multipliers.
Layout = tuple[int, str, str, str, str, str]
FMT: Layout = (128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", "", "")
UNIT: Layout = (129, "UNIT", "QbZ", "TimeUS,Id,Label", "s--", "F--")
MULT: Layout = (130, "MULT", "Qbd", "TimeUS,Id,Mult", "s--", "F--")
FMTU: Layout = (131, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---", "F---")
PARM: Layout = (132, "PARM", "QNff", "TimeUS,Name,Value,Default", "s---", "F---")
MSG: Layout = (133, "MSG", "QZ", "TimeUS,Message", "s-", "F-")
IMT: Layout = (
    134,
    "IMT",
    "QBfffffffff",
    "TimeUS,I,DelT,DelvT,DelaT,DelAX,DelAY,DelAZ,DelVX,DelVY,DelVZ",
    "s#sssrrrnnn",
    "F-000000000",
)
IMU: Layout = (
    135,
    "IMU",
    "QBffffffIIfBBHH",
    "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
    "s#EEEooo--O--zz",
    "F-000000-----00",
)
GPS: Layout = (
    136,
    "GPS",
    "QBBIHBcLLeffffB",
    "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
    "s#-s-S-DUmnhnh-",
    "F--C-0BGGB000--",
)
GPA: Layout = (
    137,
    "GPA",
    "QBCCCCfBIHfHH",
    "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,Und,RTCMFU,RTCMFD",
    "s#-mmnd-ssm--",
    "F-BBBB0-CCF--",
)
BARO: Layout = (
    138,
    "BARO",
    "QBfffcfIffB",
    "TimeUS,I,Alt,AltAMSL,Press,Temp,CRt,SMS,Offset,GndTemp,H",
    "s#mmPOnsmO-",
    "F-000B0C00-",
)
_UNITS = {"s": "s", "d": "deg", "D": "deglatitude", "U": "deglongitude", "m": "m", "n": "m/s", "r": "rad"}
_UNITS |= {"E": "rad/s", "o": "m/s/s", "h": "degheading", "#": "instance", "-": "", "S": "satellites"}
_UNITS |= {"O": "degC", "z": "Hz", "P": "Pa"}
_MULTIPLIERS = {"-": 0.0, "0": 1.0, "B": 1e-2, "C": 1e-3, "F": 1e-6, "G": 1e-7}
FIX_3D, FIX_RTK = 3, 6


def write_dataflash(path: Path, flight: ImuFlight, scenario: ImuScenario) -> None:
    """Write the log as DataFlash; a unit that does not integrate is in IMU."""
    unit = IMT if flight.is_integral else IMU
    layouts = (FMT, UNIT, MULT, FMTU, PARM, MSG, unit, GPS, GPA, *([BARO] if len(flight.aids.baro_s) else []))
    head = b"".join(_format(layout).tobytes() for layout in layouts)
    head += b"".join(_rows(UNIT, 1, Id=ord(code), Label=text.encode()).tobytes() for code, text in _UNITS.items())
    head += b"".join(_rows(MULT, 1, Id=ord(code), Mult=factor).tobytes() for code, factor in _MULTIPLIERS.items())
    for number, _name, _types, _labels, units, factors in layouts[1:]:
        head += _rows(FMTU, 1, FmtType=number, UnitIds=units.encode(), MultIds=factors.encode()).tobytes()
    stamp_us = BOOT_US + nanoseconds(flight.time_s) // 1000
    start_us = BOOT_US - 1000
    head += _rows(MSG, 1, TimeUS=start_us, Message=b"ArduPlane V4.5.7 (simulated)").tobytes()
    head += _rows(PARM, 1, TimeUS=start_us, Name=b"AHRS_ORIENTATION", Value=0.0, Default=0.0).tobytes()
    gps_us = BOOT_US + nanoseconds(flight.gnss.time_s) // 1000
    aids = flight.aids
    baro_us = BOOT_US + nanoseconds(aids.baro_s) // 1000
    streams = [
        (np.maximum.accumulate(stamp_us), _increments(flight, stamp_us) if unit is IMT else _samples(flight, stamp_us)),
        (gps_us, _gps(flight, scenario, gps_us)),
        (gps_us, _accuracies(flight, gps_us)),
    ]
    if len(baro_us):
        press, alt = pressure_pa(aids.pressure_altitude_m), aids.pressure_altitude_m
        streams.append((baro_us, _rows(BARO, len(baro_us), TimeUS=baro_us, Alt=alt - alt[0], Press=press, H=1)))
    path.write_bytes(head + joined(streams))


def _rows(layout: Layout, count: int, **values: object) -> Packed:
    number, _name, types, labels, _units, _factors = layout
    named = zip(types, labels.split(","), strict=True)
    fields = [(label, _KINDS[kind], values.get(label, 0)) for kind, label in named]
    return records(count, ("magic", "<u2", MAGIC), ("type", "u1", number), *fields)


def _format(layout: Layout) -> Packed:
    number, name, types, labels, _units, _factors = layout
    size = 3 + sum(np.dtype(_KINDS[one]).itemsize for one in types)
    columns = {"Name": name.encode(), "Format": types.encode(), "Columns": labels.encode()}
    return _rows(FMT, 1, Type=number, Length=size, **columns)


def _increments(flight: ImuFlight, stamp_us: Int64Array) -> Packed:
    intervals = dict.fromkeys(("DelT", "DelvT", "DelaT"), flight.interval_s)
    angles = {f"DelA{axis}": one for axis, one in zip("XYZ", flight.delta_angle_rad.T, strict=True)}
    velocities = {f"DelV{axis}": one for axis, one in zip("XYZ", flight.delta_velocity_mps.T, strict=True)}
    return _rows(IMT, len(stamp_us), TimeUS=stamp_us, **intervals, **angles, **velocities)


def _samples(flight: ImuFlight, stamp_us: Int64Array) -> Packed:
    step_s = flight.interval_s[:, None]
    rates = {f"Gyr{axis}": one for axis, one in zip("XYZ", (flight.delta_angle_rad / step_s).T, strict=True)}
    forces = {f"Acc{axis}": one for axis, one in zip("XYZ", (flight.delta_velocity_mps / step_s).T, strict=True)}
    hertz = {"GH": 1, "AH": 1, "GHz": 1000, "AHz": 1000}
    return _rows(IMU, len(stamp_us), TimeUS=stamp_us, **rates, **forces, T=40.0, **hertz)


def _gps(flight: ImuFlight, scenario: ImuScenario, stamp_us: Int64Array) -> Packed:
    fixes = flight.gnss
    north, east, down = fixes.velocity_mps.T
    since_ns = scenario.start_utc_ns - GPS_EPOCH_NS + LEAP_NS + nanoseconds(fixes.validity_s)
    return _rows(
        GPS,
        len(stamp_us),
        TimeUS=stamp_us,
        Status=np.where(fixes.is_precise, FIX_RTK, FIX_3D),
        GMS=since_ns % WEEK_NS // 1_000_000,
        GWk=since_ns // WEEK_NS,
        NSats=16,
        HDop=80,
        Lat=np.rint(fixes.latitude_deg * 1e7),
        Lng=np.rint(fixes.longitude_deg * 1e7),
        Alt=np.rint(fixes.height_m * 100.0),
        Spd=np.hypot(north, east),
        GCrs=np.rad2deg(np.arctan2(east, north)) % 360.0,
        VZ=down,
        U=1,
    )


def _accuracies(flight: ImuFlight, stamp_us: Int64Array) -> Packed:
    position, velocity = flight.gnss.position_sigma_m, flight.gnss.velocity_sigma_mps
    return _rows(
        GPA,
        len(stamp_us),
        TimeUS=stamp_us,
        VDop=120,
        HAcc=np.rint(100.0 * np.hypot(position[:, 0], position[:, 1])),
        VAcc=np.rint(100.0 * position[:, 2]),
        SAcc=np.rint(100.0 * velocity[:, 0]),
        VV=1,
        SMS=stamp_us // 1000,
        Delta=round(1000.0 / flight.settings.gnss.rate_hz),
    )
