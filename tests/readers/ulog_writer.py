"""A minimal ULog writer for tests, by the PX4 specification: one method for each type of message."""

import struct
from dataclasses import dataclass, field

MAGIC = b"ULog\x01\x12\x35"
SYNC = bytes.fromhex("2f731320250cbb12")
FLAG_BITS_AT = 16 + 3


@dataclass
class UlogWriter:
    """Messages in the order of the calls; ``data`` is the file so far, ``starts`` where each message begins."""

    start_us: int = 1_000_000
    version: int = 1
    data: bytearray = field(default_factory=bytearray)
    starts: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.data += MAGIC + bytes([self.version]) + struct.pack("<Q", self.start_us)

    def message(self, kind: str, body: bytes) -> "UlogWriter":
        self.starts.append(len(self.data))
        self.data += struct.pack("<HB", len(body), ord(kind)) + body
        return self

    def flags(self, *, compat: bytes = bytes(8), incompat: bytes = bytes(8), offsets: tuple[int, ...] = (0, 0, 0)):
        return self.message("B", compat + incompat + struct.pack("<3Q", *offsets))

    def append_section(self) -> "UlogWriter":
        """Note in the flags that data is appended from here on."""
        self.data[FLAG_BITS_AT + 8] |= 1
        for place in range(FLAG_BITS_AT + 16, FLAG_BITS_AT + 40, 8):
            if not any(self.data[place : place + 8]):
                self.data[place : place + 8] = struct.pack("<Q", len(self.data))
                return self
        raise AssertionError("no room for a fourth section")

    def format(self, text: str) -> "UlogWriter":
        return self.message("F", text.encode())

    def keyed(self, kind: str, key: str, value: bytes, before: bytes = b"") -> "UlogWriter":
        return self.message(kind, before + bytes([len(key)]) + key.encode() + value)

    def info(self, name: str, text: str) -> "UlogWriter":
        return self.keyed("I", f"char[{len(text.encode())}] {name}", text.encode())

    def parameter(self, name: str, value: int | float, kind: str = "P", defaults: int | None = None) -> "UlogWriter":
        before = b"" if defaults is None else bytes([defaults])
        if isinstance(value, int):
            return self.keyed(kind, f"int32_t {name}", struct.pack("<i", value), before)
        return self.keyed(kind, f"float {name}", struct.pack("<f", value), before)

    def subscribe(self, message_id: int, name: str, instance: int = 0) -> "UlogWriter":
        return self.message("A", struct.pack("<BH", instance, message_id) + name.encode())

    def row(self, message_id: int, code: str, *values: float) -> "UlogWriter":
        return self.message("D", struct.pack("<H" + code, message_id, *values))

    def text(self, time_us: int, text: str, level: int = 6) -> "UlogWriter":
        return self.message("L", struct.pack("<BQ", 0x30 + level, time_us) + text.encode())

    def tagged(self, time_us: int, text: str, tag: int, level: int = 6) -> "UlogWriter":
        return self.message("C", struct.pack("<BHQ", 0x30 + level, tag, time_us) + text.encode())

    def dropout(self, duration_ms: int) -> "UlogWriter":
        return self.message("O", struct.pack("<H", duration_ms))

    def sync(self) -> "UlogWriter":
        return self.message("S", SYNC)


ATTITUDE = "vehicle_attitude:uint64_t timestamp;float[4] q;uint8_t[4] _padding0;"
GPS = (
    "vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;int32_t lon;int32_t alt;"
    "int32_t alt_ellipsoid;float s_variance_m_s;float hdop;float vel_m_s;float vel_n_m_s;float vel_e_m_s;"
    "float vel_d_m_s;float cog_rad;uint8_t fix_type;bool vel_ned_valid;uint8_t satellites_used;uint8_t[5] _padding0;"
)
GPS_CODE = "QQiiiifffffffBBB"
BARO = "vehicle_air_data:uint64_t timestamp;float baro_pressure_pa;"


def small_flight(rows: int = 40) -> UlogWriter:
    """A log of attitude, air data, text and sync messages, 20 ms apart."""
    log = UlogWriter().flags().format(ATTITUDE).format(BARO).info("sys_name", "PX4").parameter("MC_ROLL_P", 6.5)
    log.subscribe(0, "vehicle_attitude").subscribe(1, "vehicle_air_data")
    for row in range(rows):
        time_us = 1_000_000 + 20_000 * row
        log.row(0, "Q4f", time_us, 1.0, 0.0, 0.0, 0.0).row(1, "Qf", time_us + 3, 101_325.0 - row)
        if row % 8 == 7:
            log.sync().text(time_us + 5, f"line {row}")
    return log
