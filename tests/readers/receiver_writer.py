"""Writes streams of satellite receivers for tests: UBX and NovAtel frames, NMEA sentences, RTCM 3, flights of all."""

import struct
import zlib
from datetime import UTC, datetime

import numpy as np

from groundstation.base.timescales import GPS_EPOCH_NS, iso_to_utc_ns
from groundstation.base.units import MPS_PER_KNOT, NS_PER_S
from groundstation.readers.receiver.layouts import layout
from groundstation.readers.receiver.novatel_messages import LAYOUTS as NOVATEL_LAYOUTS
from groundstation.readers.receiver.novatel_messages import NAMES
from groundstation.readers.receiver.scan import crc_tables
from groundstation.readers.receiver.ubx_messages import LAYOUTS

LEAP_S = 18
_CODES_OF = """
    NAV-PVT=0107 NAV-PVAT=0117 NAV-DOP=0104 NAV-HPPOSLLH=0114 NAV-RELPOSNED=013C NAV-ATT=0105 NAV-POSLLH=0102
    NAV-VELNED=0112 NAV-TIMEGPS=0120 NAV-STATUS=0103 NAV-SOL=0106 ESF-INS=1015 HNR-PVT=2800
"""
CODES = {word[:-5]: int(word[-4:], 16) for word in _CODES_OF.split()}


def ubx_frame(code: int, payload: bytes) -> bytes:
    """A frame of UBX; ``code`` is class * 256 + number."""
    body = code.to_bytes(2, "big") + len(payload).to_bytes(2, "little") + payload
    first = second = 0
    for byte in body:
        first = (first + byte) & 255
        second = (second + first) & 255
    return b"\xb5\x62" + body + bytes((first, second))


def ubx(name: str, **members: int | float) -> bytes:
    """A message without a group, by the members of its structure (bits together, as the message has them)."""
    dtype = layout(LAYOUTS[name]).head.dtype
    record = np.zeros(1, dtype)
    for member, value in members.items():
        record[member] = value
    return ubx_frame(CODES[name], record.tobytes())


def nmea(text: str) -> bytes:
    """A sentence from what stands between ``$`` and ``*``."""
    total = 0
    for byte in text.encode():
        total ^= byte
    return f"${text}*{total:02X}\r\n".encode()


def rtcm(number: int, size: int = 20) -> bytes:
    """A frame of RTCM 3 of ``size`` bytes behind the message number."""
    body = (number << 4).to_bytes(2, "big") + bytes(size)
    frame = b"\xd3" + len(body).to_bytes(2, "big") + body
    table, crc = crc_tables()[0], 0
    for byte in frame:
        crc = ((crc << 8) & 0xFFFFFF) ^ int(table[(crc >> 16) ^ byte])
    return frame + crc.to_bytes(3, "big")


def novatel_frame(
    number: int, body: bytes, week: int, week_ms: int, status: int = 180, *, is_short: bool = False
) -> bytes:
    """A frame of NovAtel with the long header, or the short one."""
    header = struct.pack("<3sBHHI", b"\xaaD\x13", len(body), number, week, week_ms)
    if not is_short:
        of_message = (28, number, 0, 32, len(body), 0, 0, status, week, week_ms, 0, 0, 0)
        header = struct.pack("<3sBHBBHHBBHIIHH", b"\xaaD\x12", *of_message)
    content = header + body
    return content + (zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF).to_bytes(4, "little")


def novatel(name: str, week_ms: int, status: int = 180, *, is_short: bool = False, **members: int | float) -> bytes:
    """A message of week 2417 by the members of its structure; ``week_ms`` above a week is UTC in nanoseconds."""
    record = np.zeros(1, layout(NOVATEL_LAYOUTS[name]).head.dtype)
    for member, value in members.items():
        record[member] = value
    number = next(number for number, known in NAMES.items() if known == name)
    week = 2417
    if week_ms > 604_800_000:
        week, week_ms = divmod((week_ms - GPS_EPOCH_NS + LEAP_S * NS_PER_S) // 1_000_000, 604_800_000)
    return novatel_frame(number, record.tobytes(), week, week_ms, status, is_short=is_short)


def week_ms(utc: str) -> int:
    """Milliseconds of the GPS week of a time."""
    return (iso_to_utc_ns(utc)[0] - GPS_EPOCH_NS + LEAP_S * NS_PER_S) // 1_000_000 % 604_800_000


def pvt(utc: str, nano: int = 0, itow: int | None = None, **members: int | float) -> bytes:
    """NAV-PVT with a valid 3D fix at a whole second of UTC, plus ``nano``."""
    at = datetime.fromtimestamp(iso_to_utc_ns(utc)[0] // NS_PER_S, UTC)
    told = {"year": at.year, "month": at.month, "day": at.day, "hour": at.hour, "min": at.minute, "second": at.second}
    usual = {"valid": 7, "fixType": 3, "flags": 1, "numSV": 12, "lat": 515_000_000, "lon": -7_000_000, "sAcc": 100}
    told["iTOW"] = week_ms(utc) if itow is None else itow
    return ubx("NAV-PVT", **(usual | told | {"nano": nano} | members))


def gga(time: str, latitude: str = "5130.00000,N", longitude: str = "00042.00000,W", quality: int = 1) -> bytes:
    """GGA of a talker GN."""
    return nmea(f"GNGGA,{time},{latitude},{longitude},{quality},12,0.80,100.0,M,47.0,M,,")


def rmc(time: str, date: str, speed_mps: float = 10.0, track_deg: float = 90.0, status: str = "A") -> bytes:
    """RMC of a talker GN."""
    knots = speed_mps / MPS_PER_KNOT
    return nmea(f"GNRMC,{time},{status},5130.00000,N,00042.00000,W,{knots:.9f},{track_deg:.4f},{date},,,A")


def measured(tick_ms: int, *values: tuple[int, int]) -> bytes:
    """ESF-MEAS with values of some types."""
    words = b"".join(struct.pack("<I", (value & 0xFFFFFF) | kind << 24) for kind, value in values)
    return ubx_frame(0x1002, struct.pack("<IHH", tick_ms, len(values) << 11, 0) + words)


def raw_sensors(start_ms: int, tag: int, samples: int) -> bytes:
    """ESF-RAW with several samples of six sensors, 10 ms (256 ticks) apart."""
    body = struct.pack("<I", start_ms)
    for number in range(samples):
        values = ((14, 4096 + number), (13, -4096), (5, 8192), (16, 1024), (17, 0), (18, -10 * 1024))
        for kind, value in values:
            body += struct.pack("<II", (value & 0xFFFFFF) | kind << 24, (tag + 256 * number) % (1 << 24))
    return ubx_frame(0x1003, body)


def raw_imu(name: str, seconds: float, unit: int = 41, status: int = 4, **counts: int) -> bytes:
    stated = {"imu_status_info": status, "imu_type": unit} if name.endswith("X") else {}
    is_short = name in ("RAWIMUS", "RAWIMUSX")
    return novatel(name, round(1000.0 * seconds), is_short=is_short, week=2417, seconds=seconds, **stated, **counts)


COUNTS = dict(
    zip([f"del_{what}_body_{axis}" for what in ("vel", "ang") for axis in "zyx"], (1, 2, 3, 4, 5, 6), strict=True)
)


def ubx_imu_log(seconds: int = 30) -> bytes:
    """A stream of UBX with both messages of a receiver's own sensors, some 40 kB."""
    log = b""
    for at in range(seconds):
        log += pvt(f"2026-05-04T12:00:{at:02d}Z")
        for part in range(4):
            start_ms = 5_060 + 1_000 * at + 250 * part
            log += measured(start_ms, (14, 40 * at), (13, -part), (5, 8192), (16, 1024), (17, 7), (18, -10 * 1024))
            log += raw_sensors(start_ms, (1 << 23) + 6_400 * (4 * at + part), 4)
    return log


def novatel_imu_log(seconds: int = 30) -> bytes:
    """A stream of NovAtel with the counts of its inertial unit, in binary and as text, some 40 kB."""
    log = b""
    for at in range(seconds):
        seconds_of_week = 129_618.0 + at
        log += novatel("BESTPOS", 1_000 * (129_618 + at), latitude=51.5, longitude=at / 1e4, num_soln_svs=9)
        for part in range(10):
            name = "RAWIMUX" if part == 9 else "RAWIMUS" if part == 8 else "RAWIMUSX"
            log += raw_imu(name, seconds_of_week + 0.1 * part, 58, **(COUNTS | {"del_ang_body_z": 100 * at}))
        time = f"2417,{seconds_of_week:.3f}"
        log += novatel_text(f"RAWIMUSXA,{time}", f"00,41,{time}000,ea59fe00,329308016,-2706935,4508389,1,2,-3", "%")
    return log


def ubx_log(seconds: int = 120) -> bytes:
    """A stream of UBX with everything between, some 40 kB."""
    log = b""
    for at in range(seconds):
        utc = f"2026-05-04T12:{at // 60:02d}:{at % 60:02d}Z"
        itow = week_ms(utc)
        log += pvt(utc, nano=-250 * at) + ubx("NAV-DOP", iTOW=itow, gDOP=150 + at) + rtcm(1077, at)
        log += ubx("NAV-ATT", iTOW=itow, heading=at * 100_000, accHeading=1) + ubx_frame(0x0213, bytes(8 + at))
        log += (
            gga(f"12{at // 60:02d}{at % 60:02d}.00")
            + ubx_frame(0x0402, b"notice")
            + ubx_frame(0x0135, bytes(8 + 12 * 9))
        )
    return log


def nmea_log(seconds: int = 200) -> bytes:
    """A stream of sentences, some 40 kB."""
    log = b""
    for at in range(seconds):
        time = f"12{at // 60:02d}{at % 60:02d}.50"
        log += gga(time) + rmc(time, "040526", at / 10, at) + nmea(f"GNHDT,{at}.25,T")
        log += nmea("GPGSV,1,1,02,14,55,175,46,40,29,043,18,1")
        log += nmea(f"PASHR,{time},301.5,T,-1.25,2.5,0.1,.1,.1,.1,2,1")
    return log


def novatel_log(seconds: int = 120) -> bytes:
    """A stream of NovAtel frames with both headers, some 60 kB."""
    log = b""
    for at in range(seconds):
        ms = 129_618_000 + 1000 * at
        log += novatel("BESTPOS", ms, latitude=51.5, longitude=at / 1e4, num_soln_svs=9)
        log += novatel("BESTVEL", ms, horizontal_speed=at / 10.0) + novatel("INSCOVS", ms, is_short=True, week=2417)
        log += novatel("INSPVAS", ms, is_short=True, week=2417, seconds=ms / 1e3, azimuth=at, ins_solution_status=3)
    return log


def novatel_crc(text: bytes) -> bytes:
    """CRC of a NovAtel log in text, as its digits."""
    return b"%08x" % (zlib.crc32(text, 0xFFFFFFFF) ^ 0xFFFFFFFF)


def novatel_text(header: str, body: str, mark: str = "#") -> bytes:
    """A NovAtel log in text: its header, body and checksum."""
    text = f"{header};{body}".encode()
    return mark.encode() + text + b"*" + novatel_crc(text) + b"\r\n"


_BESTPOS_TEXT = 'SOL_COMPUTED,SINGLE,{},37.5,120.0,15.0,WGS84,1.5,1.2,2.5,"",0.0,0.0,12,10,10,0,0,06,00,33'
_BESTVEL_TEXT = "SOL_COMPUTED,DOPPLER_VELOCITY,0.15,0.0,10.0,90.0,-1.0,0.0"


def novatel_text_log(seconds: int = 20) -> bytes:
    """A drive as text; every INS solution has a short header."""
    log = b""
    for second in range(seconds):
        header = f"COM1,0,80.0,FINESTEERING,2417,{129_618 + second}.000,02000020,1234,16809"
        log += novatel_text(f"BESTPOSA,{header}", _BESTPOS_TEXT.format(55.0 + second / 1e4))
        log += novatel_text(f"BESTVELA,{header}", _BESTVEL_TEXT)
        time = f"2417,{129_618 + second}.000"
        place = "55.0,37.5,135.0,0.0,10.0,1.0,1.5,-2.0,90.5"
        log += novatel_text(f"INSPVASA,{time}", f"{time},{place},INS_SOLUTION_GOOD", "%")
    return log
