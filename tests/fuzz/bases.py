"""Logs that are mutated: sound ones and some made to harm, and the beginnings of recorded ones where those are."""

import gzip
import io
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import zstandard
from mcap.writer import CompressionType, Writer

from tests.fuzz.harmful import bomb, computed_sqlite3, unallocated_hdf5
from tests.readers.bag_writer import small_flight as small_flight_of_a_robot
from tests.readers.bag_writer import write_ros1, write_ros2
from tests.readers.dataflash_writer import MAGIC as DATAFLASH_MAGIC
from tests.readers.dataflash_writer import flight_log
from tests.readers.flightdata_writer import write_flightdata
from tests.readers.receiver_writer import (
    nmea_log,
    novatel_imu_log,
    novatel_log,
    novatel_text_log,
    ubx_imu_log,
    ubx_log,
)
from tests.readers.telemetry_writer import telemetry
from tests.readers.trajectory_writer import PLACE, VELOCITY, pos_rows, sbet
from tests.readers.ulog_writer import GPS, GPS_CODE, small_flight
from tests.real_logs import REAL_LOGS

SAMPLES = Path(__file__).parents[2] / "sample_logs"
CSV_BYTES, BINARY_BYTES = 40_000, 150_000  # of a recorded log: enough for all that it defines


@dataclass(frozen=True, eq=False)
class Base:
    """A log before it is mutated.

    Parameters
    ----------
    name : str
        ``ulog-written``, or ``ulog-`` and the name of the recorded log.
    format : str
    data : bytes
    starts : ndarray of int64
        Where its records begin, as far as known: their lengths stand there.
    is_recorded : bool
        It is of a real aircraft: nothing of it may be kept.
    is_harmful : bool
        It is no sound log, but one that would take memory or time without end.
    """

    name: str
    format: str
    data: bytes
    starts: np.ndarray
    is_recorded: bool = False
    is_harmful: bool = False


def flat_csv() -> bytes:
    """A flat CSV with every kind of cell, some 20 kB."""
    lines = ["# aircraft: SIM-1", "# start_utc: 2026-05-04T06:00:00Z"]
    lines.append("time_s,ins.roll_deg,ins.true_heading_deg,ins.mode,ins.valid,gnss.latitude_deg,event.name,volts,note")
    for row in range(400):
        gnss = f"{55 + row * 1e-6:.6f}" if row % 5 == 0 else ""
        event = "start" if row == 7 else ""
        note = f'"a, {row}"'
        lines.append(f"{row / 50:.3f},{row % 7 - 3.5},{row % 360},nav,{row % 2},{gnss},{event},{row % 28},{note}")
    return ("\n".join(lines) + "\n").encode()


def _noisy_csv() -> bytes:
    """A flat CSV of some 200 kB that compresses as badly as a recorded one, in several blocks."""
    rng = np.random.default_rng(20_260_504)
    rows = (f"{row / 50:.3f},{roll:.4f},{rate:.5f}" for row, (roll, rate) in enumerate(rng.normal(size=(9_000, 2))))
    return ("time_s,ins.roll_deg,ins.rate_x_dps\n" + "\n".join(rows) + "\n").encode()


def g1000() -> bytes:
    """A table as Garmin's G1000 writes it, some 30 kB."""
    names = "Lcl Date, Lcl Time, UTCOfst, Latitude, Longitude, GndSpd, HDG, TRK, MagVar, AltGPS, AltInd, BaroA, GPSfix"
    lines = ['#airframe_info, log_version="1.03", airframe_name="X"', "#yyy-mm-dd, hh:mm:ss, hh:mm, degrees", names]
    for row in range(400):
        clock = f"12:{row // 60:02d}:{row % 60:02d}"
        place = f"{49 + row * 1e-5:.6f}, 4.250000, {row % 120}.5" if row > 20 else "  ,  ,  "
        lines.append(f"2022-04-17, {clock}, +02:00, {place}, {row % 360}.1, {row % 360}.9, 1.5, 900, 850, 29.92, 3D")
    return ("\r\n".join(lines) + "\r\n").encode()


def ulog() -> bytes:
    """A ULog with attitude, air data, GPS, nested definitions, text and sync messages, some 30 kB."""
    log = small_flight(300)
    log.format(GPS).format("point:float x;float y;").format("track:uint64_t timestamp;point[3] at;char[8] name;")
    log.subscribe(2, "vehicle_gps_position").subscribe(3, "track", 1)
    for row in range(60):
        time_us = 7_000_000 + 100_000 * row
        place = (1_700_000_000_000_000 + 100_000 * row, 550_000_000 + row, 370_000_000, 200_000, 210_000)
        log.row(2, GPS_CODE, time_us, *place, 0.05, 1.0, 5.0, 3.0, 4.0, 0.0, 0.1, 3, 1, 12)
        log.row(3, "Q6f8s", time_us + 9, *range(6), b"abc")
    return bytes(log.dropout(30).data)


def _bag(form: str) -> bytes:
    """Messages of a robot in one of their containers, some 60 kB."""
    with tempfile.TemporaryDirectory() as folder:
        if form == "ros1":
            return write_ros1(
                Path(folder) / "a.bag", small_flight_of_a_robot(is_ros1=True, rows=60), "lz4"
            ).read_bytes()
        bag = write_ros2(Path(folder) / "bag", small_flight_of_a_robot(rows=60), form)
        return next(path for path in bag.iterdir() if path.suffix != ".yaml").read_bytes()


def ros1_starts(data: bytes) -> Iterator[int]:
    """Where records begin outside of chunks."""
    at = 13
    while at + 8 <= len(data):
        yield at
        at += 4 + int.from_bytes(data[at : at + 4], "little")
        at += 4 + int.from_bytes(data[at : at + 4], "little")


def dataflash() -> bytes:
    """A DataFlash log of today's layout, some 30 kB."""
    return flight_log(8).content


def pos() -> bytes:
    """A solution of RTKLIB, some 40 kB."""
    rows = [
        f"2025/08/28 17:{at // 60:02d}:{at % 60:02d}.000  {PLACE}  {1 + at % 2}  21 "
        f"{' '.join(['0.0300'] * 6)} 0.00 9.9 {VELOCITY}"
        for at in range(200)
    ]
    return pos_rows(rows)


@cache
def _converted(path: Path) -> bytes:
    from groundstation.pipeline.one_flight.convert import convert_log
    from groundstation.pipeline.one_flight.log import open_log

    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "flight.mcap"
        convert_log(open_log(path), target)
        return target.read_bytes()


def ulog_starts(data: bytes) -> Iterator[int]:
    """Where messages begin."""
    at = 16
    while at + 3 <= len(data):
        yield at
        at += 3 + int.from_bytes(data[at : at + 2], "little")


def mcap_starts(data: bytes) -> Iterator[int]:
    """Where MCAP records begin."""
    at = 8
    while at + 9 <= len(data):
        yield at
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")


def flatbuffer() -> bytes:
    """An MCAP without checksums of messages in FlatBuffers, every kind of value in them."""
    stream, folder = io.BytesIO(), Path(__file__).parents[1] / "references" / "flatbuffers"
    writer = Writer(stream, chunk_size=4_000, compression=CompressionType.NONE, enable_crcs=False)
    writer.start()
    schema = writer.register_schema("own.State", "flatbuffer", (folder / "every_kind.bfbs").read_bytes())
    channel, message = writer.register_channel("/state", "flatbuffer", schema), (folder / "every_kind.bin").read_bytes()
    for at in range(100):
        writer.add_message(channel, 1_777_874_400_000_000_000 + at * 10**8, message, 0, at)
    writer.finish()
    return stream.getvalue()


def chapter10() -> bytes:
    """The beginning of a simulated flight as Chapter 10: 1553, ARINC 429 and time, some 150 kB."""
    from groundstation.simulation.chapter10_writer import write_chapter10
    from groundstation.simulation.flight import simulate
    from groundstation.simulation.scenario import load_scenario

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.ch10"
        write_chapter10(path, simulate(load_scenario("taxi-short")).flight)
        return _cut(path.read_bytes(), "chapter10", BINARY_BYTES)


def chapter10_starts(data: bytes) -> Iterator[int]:
    """Where packets begin."""
    at = 0
    while at + 24 <= len(data):
        yield at
        at += int.from_bytes(data[at + 4 : at + 8], "little")


def line_starts(data: bytes) -> Iterator[int]:
    """Where lines begin."""
    at = 0
    while 0 <= at < len(data):
        yield at
        at = data.find(b"\n", at) + 1 or -1


def starts_with(magic: bytes) -> Callable[[bytes], Iterator[int]]:
    """Where something that looks like a record begins."""

    def starts(data: bytes) -> Iterator[int]:
        at = data.find(magic)
        while at >= 0:
            yield at
            at = data.find(magic, at + len(magic))

    return starts


def hdf5() -> bytes:
    """A recording of an airliner of 20 s."""
    rows = np.arange(20.0)
    parameters = {
        "Latitude": {"data": 60.0 + 0.001 * rows, "offset": 0.75, "units": "deg"},
        "Longitude": {"data": 10.0 + 0.002 * rows, "offset": 0.5, "units": "deg"},
        "Heading True": {"data": (350.0 + rows) % 360.0, "offset": 0.25},
        "Groundspeed": {"data": 100.0 + rows, "offset": 0.75, "units": "kts"},
        "Acceleration Normal": {"data": np.ones(160), "frequency": 8.0},
        "Flap": {"data": np.full(20, 15.0), "mask": rows % 2 == 0, "lfl": False},
    }
    with tempfile.TemporaryDirectory() as folder:
        return write_flightdata(Path(folder) / "log.hdf5", parameters).read_bytes()


def hdf5_starts(data: bytes) -> Iterator[int]:
    """Where the parts of an HDF5 file begin that lead to others: its head, trees, symbol tables, names."""
    for magic in (b"\x89HDF", b"TREE", b"SNOD", b"HEAP"):
        for at in starts_with(magic)(data):
            yield from range(at + 4, min(at + 40, len(data)), 8)


def waypoint() -> bytes:
    """Text of Inertial Explorer: blanks, GPS weeks, degrees, minutes and seconds."""
    head = (
        "Project:     line 7\nProgram:     Inertial Explorer Version 8.90\n\n"
        " Week    GPSTime       Latitude       Longitude      H-Ell    VEast SDEast SDNorth    Heading Q\n"
        "           (sec)      (+/-D M S)      (+/-D M S)       (m)    (m/s)    (m)     (m)      (deg)\n"
    )
    rows = (
        f" 2313 {122418 + k}.000 47 00 {k % 60:02d}.50000 -0 30 {k % 60:02d}.0  91.4  12.0 0.03 0.04 90.0 1\n"
        for k in range(200)
    )
    return (head + "".join(rows)).encode()


def states() -> bytes:
    """State vectors of three aircraft."""
    head = "time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,alert,spi,squawk,baroaltitude,geoaltitude\n"
    names = ("4b1814", "3c6444", "400abc")
    rows = (
        f"{1714989600 + k // 3},{names[k % 3]},47.{k},8.{k},100,90,NULL,X,False,,,7000,NaN,900\n" for k in range(300)
    )
    return (head + "".join(rows)).encode()


def skyview() -> bytes:
    """User log of a SkyView: UTC in whole seconds beside a counter."""
    head = (
        "Session Time,GPS Fix Quality,Number of Satellites,GPS Date & Time,Latitude (deg),Longitude (deg),"
        "GPS Altitude (feet),Ground Speed (knots),Ground Track (deg),Mag Var (deg),Pitch (deg),Roll (deg),"
        "Magnetic Heading (deg)\n"
    )
    rows = (
        f"{500 + k / 4},2,9,2024-05-06 10:00:{k // 4 % 60:02d},27.{k},-82.4,1000,100,90,5,1,2,85\n" for k in range(200)
    )
    return (head + "".join(rows)).encode()


def radio() -> bytes:
    """Log of a radio: two numbers in one cell, date and time in two."""
    head = "Date,Time,1RSS(dB),GPS,GSpd(kmh),Hdg(\u00b0),Sats,Curr(A),Rud,Ele,Thr,Ail,TxBat(V)\n"
    rows = (
        f"2024-05-06,10:{k // 60:02d}:{k % 60:02d}.500,-70,47.{k:06d} -122.25,36.0,90,12,5.5,0,0,-1024,0,7.9\n"
        for k in range(200)
    )
    return (head + "".join(rows)).encode()


def igc() -> bytes:
    """Flight record of a glider."""
    head = "AXXX001\r\nHFDTE060524\r\nHFGIDGLIDERID:D-1\r\nI023638FXA3940SIU\r\n"
    rows = (f"B2359{k % 60:02d}4730{k:03d}N00815000EA010000110000509\r\n" for k in range(200))
    return (head + "".join(rows) + "E100000PEV\r\n").encode()


def flysight2() -> bytes:
    """Fixes and sensors of a FlySight 2 in one file."""
    head = (
        "$FLYS,1\n$VAR,DEVICE_ID,abc\n$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,numSV\n"
        "$UNIT,GNSS,,deg,deg,m,m/s,m/s,m/s,m,m,m/s,\n$COL,BARO,time,pressure,temperature\n"
        "$COL,IMU,time,wx,wy,wz,ax,ay,az,temperature\n$COL,TIME,time,tow,week\n$DATA\n"
    )
    rows = (
        f"$GNSS,2024-05-06T10:{k // 60:02d}:{k % 60:02d}.200Z,47.{k:07d},-122.25,100.5,3.0,4.0,-2.0,1.5,2.5,0.2,9\n"
        f"$IMU,{500 + k}.000,1.5,-2,0,0,0,1.0,25.5\n$BARO,{500 + k}.050,101325.00,20.5\n"
        f"$TIME,{500 + k}.100,{122418 + k}.100,2313\n"
        for k in range(100)
    )
    return (head + "".join(rows)).encode()


_STARTS: dict[str, Callable[[bytes], Iterator[int]]] = {
    "flat-csv": line_starts,
    "csv-profile": line_starts,
    "tables": line_starts,
    "igc": line_starts,
    "ulog": ulog_starts,
    "dataflash": starts_with(DATAFLASH_MAGIC),
    "mcap": mcap_starts,
    "gzip": lambda data: iter(range(min(18, len(data)))),
    "zstd": lambda data: iter(range(min(18, len(data)))),
    "robot-mcap": mcap_starts,
    "ros1": ros1_starts,
    "sqlite3": lambda data: iter(range(0, len(data), 4096)),
    "chapter10": chapter10_starts,
    "ubx": starts_with(b"\xb5\x62"),
    "nmea": line_starts,
    "novatel": starts_with(b"\xaaD"),
    "novatel-text": line_starts,
    "flatbuffer": mcap_starts,
    "pos": line_starts,
    "sbet": lambda data: iter(range(0, len(data), 136)),
    "tlog": lambda data: iter(range(0, len(data), 48)),
    "hdf5": hdf5_starts,
    "flysight2": line_starts,  # last: the place of a format is part of its seeds
}
FORMATS = tuple(_STARTS)
_WRITTEN: dict[str, tuple[Callable[[], bytes], ...]] = {
    "flat-csv": (
        flat_csv,
        lambda: (SAMPLES / "taxi-short.csv").read_bytes(),  # something is estimated of these
        lambda: (SAMPLES / "taxi-damaged.csv").read_bytes(),
    ),
    "csv-profile": (g1000,),
    "tables": (waypoint, states, skyview, radio),
    "igc": (igc,),
    "flysight2": (flysight2,),
    "ulog": (ulog,),
    "dataflash": (dataflash,),
    "chapter10": (chapter10,),
    "mcap": (lambda: _converted(SAMPLES / "taxi-short.csv"),),
    "gzip": (lambda: gzip.compress(_noisy_csv(), mtime=0), lambda: gzip.compress(dataflash(), mtime=0)),
    "zstd": (lambda: zstandard.compress(_noisy_csv()), lambda: zstandard.compress(ulog())),
    "robot-mcap": (lambda: _bag("mcap"),),
    "ros1": (lambda: _bag("ros1"),),
    "sqlite3": (lambda: _bag("sqlite3"),),
    "ubx": (ubx_log, ubx_imu_log),
    "nmea": (nmea_log,),
    "novatel": (novatel_log, novatel_imu_log),
    "novatel-text": (novatel_text_log,),
    "flatbuffer": (flatbuffer,),
    "pos": (pos,),
    "sbet": (lambda: sbet(count=300).tobytes(),),
    "tlog": (lambda: bytes(telemetry().data),),
    "hdf5": (hdf5,),
}
_HARMFUL: dict[str, Callable[[], bytes]] = {
    "gzip": lambda: bomb(lambda data: gzip.compress(data, mtime=0)),
    "zstd": lambda: bomb(zstandard.compress),
    "sqlite3": lambda: computed_sqlite3(_bag("sqlite3")),
    "hdf5": lambda: unallocated_hdf5(hdf5()),
}
_RECORDED = {
    "csv-profile": ("g1000/log_220502_135932_EGPN.csv", "fixedwing/umn_thor_flight75.csv"),
    "ulog": ("ulog/sample_px4_events.ulg", "ulog/pyulog_sample_log_small_vtol.ulg"),
    "dataflash": ("damaged/erle_tiny_no_gps.BIN", "dataflash/TestLog2_REENCODED_plane.BIN"),
    "chapter10": ("ch10/kc135_429_1553_1MB.c10", "ch10/iliad_1553.c10"),
    "mcap": ("g1000/log_220416_161856_LFQA.csv",),
    "robot-mcap": ("foreign/husky_100s_ros1msg_lz4.mcap", "foreign/pntos_120s_json_lz4.mcap"),
    "ros1": ("foreign/pntos_120s_ros1.bag",),
    "ubx": ("gnss/walk_0827_gnss_1730.ubx", "gnss/ublox_ins_drive_pvat.ubx"),
    "nmea": ("gnss/inertialsense_Serial38400.nmea",),
    "pos": ("gnss/walk_0827_gnss_1730_sf.pos",),
}


def _cut(data: bytes, format_name: str, size: int) -> bytes:
    """The beginning of a log, ended behind a whole record."""
    if len(data) <= size:
        return data
    ends = list(_STARTS[format_name](data[: size + 1]))
    return data[: ends[-1]]


def _make(name: str, format_name: str, data: bytes, **kind: bool) -> Base:
    return Base(name, format_name, data, np.fromiter(_STARTS[format_name](data), np.int64), **kind)


@cache
def bases(format_name: str, *, recorded: bool = True) -> tuple[Base, ...]:
    """Logs of a format, those written here first, then what is made to harm."""
    found = [
        _make(f"{format_name}-written-{number}", format_name, write())
        for number, write in enumerate(_WRITTEN[format_name], 1)
    ]
    if format_name in _HARMFUL:
        found.append(_make(f"{format_name}-harmful", format_name, _HARMFUL[format_name](), is_harmful=True))
    for name in _RECORDED.get(format_name, ()) if recorded else ():
        path = REAL_LOGS / name
        if not path.exists():
            continue
        if format_name == "mcap":
            data = _converted(path)
        else:
            data = _cut(path.read_bytes(), format_name, CSV_BYTES if "csv" in format_name else BINARY_BYTES)
        found.append(_make(f"{format_name}-{Path(name).stem}", format_name, data, is_recorded=True))
    return tuple(found)


def base_named(name: str) -> Base | None:
    """The base of a name; None where its recorded log is not here."""
    known = (base for format_name in FORMATS if name.startswith(format_name) for base in bases(format_name))
    return next((base for base in known if base.name == name), None)
