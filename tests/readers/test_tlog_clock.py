"""Values of telemetry are valid by the vehicle's clock, whatever the link and the ground station's clock do."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2

from groundstation.base.records import RecordBatch, Remark
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.pipeline.one_flight.convert import Converted, convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry
from groundstation.readers.source import Source
from groundstation.tables.table import Flight
from tests.readers.telemetry_writer import START_US, Telemetry
from tests.readers.test_contract import check
from tests.real_logs import real_log

US = 10**6
ROWS = 1_200  # at 5 Hz: four minutes
SENT_US = START_US + np.arange(ROWS) * US // 5
DELAY_US = 20_000  # of the link, at least
BOOT_US = START_US - 600 * US  # the vehicle was switched on ten minutes before
MILLISECOND_NS = 1_000_000  # what time_boot_ms is rounded to
DEG7 = 10_000_000
Clock = Callable[[Any], Any]


def right(time_us: Any) -> Any:
    return time_us


def in_bursts(period_s: float) -> Clock:
    """A link that delivers what was sent once in so many seconds, when the last of it was sent."""
    period_us, frame_us = round(period_s * US), US // 5

    def arrival(sent_us: Any) -> Any:
        end_us = ((sent_us - START_US) // period_us + 1) * period_us
        return START_US + (end_us - 1) // frame_us * frame_us

    return arrival


@dataclass
class Vehicle:
    """What one vehicle sends: the clock that its messages tell, and what they say of UTC.

    ``boot`` is UTC to time since it was switched on; ``utc`` UTC to what it takes for UTC, None where it has none.
    """

    boot: Clock = lambda time_us: time_us - BOOT_US
    utc: Clock | None = right
    system: int = 1
    component: int = 1
    fix_time: Clock | None = None
    zeros: int = 0
    sent: Any = field(default_factory=lambda: SENT_US)

    def frames(self, dialect: Any = v2) -> list[tuple[int, bytes]]:
        """UTC of sending, and frame."""
        sender = dialect.MAVLink(None, srcSystem=self.system, srcComponent=self.component)
        found: list[tuple[int, bytes]] = []
        for row, sent_us in enumerate(self.sent.tolist()):
            boot_us = int(self.boot(sent_us))
            boot_ms = boot_us // 1_000 % (1 << 32)
            north, east = (0, 0) if row < self.zeros else (55 * DEG7 + row * 100, 37 * DEG7)
            fix_us = boot_us if self.fix_time is None else int(self.fix_time(sent_us))
            kinds = [
                dialect.MAVLink_attitude_message(boot_ms, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0),
                dialect.MAVLink_global_position_int_message(boot_ms, north, east, 200_000, 9_000, 100, 0, 0, 0),
                dialect.MAVLink_gps_raw_int_message(fix_us, 3, north, east, 200_000, 120, 200, 500, 9_000, 12),
                dialect.MAVLink_vfr_hud_message(5.0, 5.0, 0, 50, 200.0, 0.0),
                dialect.MAVLink_servo_output_raw_message(boot_us % (1 << 32), 0, *[1_500] * 8),
            ]
            if row % 5 == 0:
                utc_us = 0 if self.utc is None else int(self.utc(sent_us))
                kinds.append(dialect.MAVLink_system_time_message(utc_us, boot_ms))
                kinds.append(dialect.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3))
            found += [(sent_us, kind.pack(sender)) for kind in kinds]
        return found


@dataclass
class Link:
    """How frames are received: when by UTC, and by which clock."""

    arrival: Clock = right
    ground: Clock = right
    data: bytearray = field(default_factory=bytearray)

    def write(self, path: Path, *frames: list[tuple[int, bytes]]) -> Path:
        """A log of the frames of some vehicles."""
        everything = sorted((frame for several in frames for frame in several), key=lambda frame: frame[0])
        arrived_us = np.maximum.accumulate(self.arrival(np.array([sent for sent, _frame in everything])) + DELAY_US)
        for received_us, (_sent_us, frame) in zip(self.ground(arrived_us).tolist(), everything, strict=True):
            self.data += int(received_us).to_bytes(8, "big") + frame
        path.write_bytes(self.data)
        return path


def converted(path: Path) -> tuple[Flight, Converted]:
    check(list(registry.read(path)))
    found = convert_log(open_log(path), path.with_suffix(".mcap"))
    return read_flight(path.with_suffix(".mcap"), found), found


def expect(
    flight: Flight, found: Converted, *, off_ns: int = 0, tolerance_ns: int = MILLISECOND_NS, suffix: str = ""
) -> None:
    """Every message is valid when it was sent; none is missing, none repeats."""
    topics = ("ins", "gnss", "raw.VFR_HUD", "raw.SERVO_OUTPUT_RAW") if not suffix else (f"raw.ATTITUDE{suffix}",)
    for topic in topics:
        away_ns = flight[topic].time_ns - SENT_US * 1_000 - off_ns
        entry = found.info.ledger.topics[topic]
        assert np.abs(away_ns).max() <= tolerance_ns, topic
        assert entry.nominal_rate_hz == pytest.approx(5.0, rel=1e-3) and not entry.gaps.count, topic


def test_bursts_are_no_gaps_and_no_speeds(tmp_path: Path) -> None:
    flight, found = converted(Link(in_bursts(4.85)).write(tmp_path / "a.tlog", Vehicle().frames()))
    expect(flight, found)
    assert len(flight["ins"]) == len(flight["gnss"]) == ROWS, "attitude and position of one instant are one row"
    north_m = np.diff(flight["gnss"].values("latitude_deg")) * 111_000
    assert (north_m / np.diff(flight["gnss"].time_ns) * 1e9).max() < 2 * 5.6
    (told,) = [one["text"] for one in found.info.remarks if one["code"] == "link_delay"]
    of_first = "the first 4.800 s after the earliest value is valid (with +0.020 s of the clock its reading is +4.820 s"
    assert told.startswith(f"frames arrived up to 4.80 s late, {of_first} from that value); values are valid by")
    assert found.info.clock.first_device_time == utc_ns_to_iso(flight.start_ns + 4_820 * MILLISECOND_NS)


def test_times_of_receipt_are_kept(tmp_path: Path) -> None:
    link = Link(in_bursts(3.0), lambda time_us: time_us - 100 * US)
    path = link.write(tmp_path / "a.tlog", Vehicle().frames())
    received = np.concatenate(
        [
            item.device_time_ns.values
            for item in registry.read(path)
            if isinstance(item, RecordBatch) and item.topic == "gnss"
        ]
    )
    assert (received == (in_bursts(3.0)(SENT_US) + DELAY_US - 100 * US) * 1_000).all()
    expect(*converted(path))


@pytest.mark.parametrize("dialect", [v1, v2], ids=["version 1", "version 2"])
def test_without_utc_the_frames_that_arrive_soonest_tell_it(tmp_path: Path, dialect: Any) -> None:
    path = Link(in_bursts(2.0)).write(tmp_path / "a.tlog", Vehicle(utc=None).frames(dialect))
    expect(*converted(path), off_ns=DELAY_US * 1_000)


def test_utc_is_the_vehicles_own(tmp_path: Path) -> None:
    """Its receiver had none at first, then one that was two seconds off; the ground station is an hour off."""

    def utc(time_us: int) -> int:
        return 0 if time_us < SENT_US[200] else time_us + 2 * US if time_us < SENT_US[600] else time_us

    link = Link(in_bursts(1.0), lambda time_us: time_us + 3_600 * US)
    flight, found = converted(link.write(tmp_path / "a.tlog", Vehicle(utc=utc).frames()))
    expect(flight, found)
    assert any("is +3600" in one["text"] for one in found.info.remarks)


def test_a_receiver_that_counts_other_weeks_tells_no_date(tmp_path: Path) -> None:
    vehicle = Vehicle(utc=lambda time_us: time_us - 1_024 * 604_800 * US)
    expect(*converted(Link().write(tmp_path / "a.tlog", vehicle.frames())), off_ns=DELAY_US * 1_000)


@pytest.mark.parametrize("has_utc", [True, False])
@pytest.mark.parametrize("by_s", [-3_600.0, -2.5, 95.0, 1e9])
def test_a_ground_station_whose_clock_is_set(tmp_path: Path, by_s: float, has_utc: bool) -> None:
    """What stands behind the last step is right."""
    link = Link(in_bursts(1.6), lambda time_us: np.where(time_us < SENT_US[500], time_us - round(by_s * US), time_us))
    path = link.write(tmp_path / "a.tlog", Vehicle(utc=right if has_utc else None).frames())
    expect(*converted(path), off_ns=0 if has_utc else DELAY_US * 1_000)


@pytest.mark.parametrize("has_utc", [True, False])
@pytest.mark.parametrize("up_s", [600, 7])
def test_a_vehicle_that_is_switched_on_again(tmp_path: Path, up_s: int, has_utc: bool) -> None:
    again_us = SENT_US[400] - 5 * US
    first_us = SENT_US[0] - up_s * US
    vehicle = Vehicle(boot=lambda time_us: time_us - (first_us if time_us < SENT_US[400] else again_us))
    vehicle.utc = right if has_utc else None
    flight, found = converted(Link(in_bursts(1.2)).write(tmp_path / "a.tlog", vehicle.frames()))
    expect(flight, found, off_ns=0 if has_utc else DELAY_US * 1_000)
    assert any("started again" in one["text"] for one in found.info.remarks)


def test_a_clock_that_starts_again_at_32_bits(tmp_path: Path) -> None:
    """After 49.7 days of time_boot_ms; those of 71 minutes of SERVO_OUTPUT_RAW are many."""
    vehicle = Vehicle(boot=lambda time_us: time_us - SENT_US[300] + (1 << 32) * 1_000)
    expect(*converted(Link(in_bursts(2.0)).write(tmp_path / "a.tlog", vehicle.frames())))


@pytest.mark.parametrize("utc", [right, None])
def test_a_fix_may_tell_the_time_since_1970(tmp_path: Path, utc: Clock | None) -> None:
    vehicle = Vehicle(fix_time=right, utc=utc)
    expect(
        *converted(Link(in_bursts(2.0), lambda time_us: time_us + 7 * US).write(tmp_path / "a.tlog", vehicle.frames()))
    )


@pytest.mark.parametrize("frozen", [0, 17 * US, BOOT_US])
def test_a_time_that_does_not_go_on_is_not_believed(tmp_path: Path, frozen: int) -> None:
    """Of a receiver that lost its fix; its messages are valid between those around them."""
    vehicle = Vehicle(fix_time=lambda _time_us: frozen)
    flight, found = converted(Link(in_bursts(2.0)).write(tmp_path / "a.tlog", vehicle.frames()))
    expect(flight, found, tolerance_ns=200 * MILLISECOND_NS)


def test_each_sender_has_its_own_clock(tmp_path: Path) -> None:
    """Two vehicles, the second without UTC, a camera of the first with a clock of its own, one part without any."""
    other = Vehicle(boot=lambda time_us: time_us - START_US + 31 * US, utc=None, system=2)
    camera = Vehicle(boot=lambda time_us: time_us - START_US + 4 * US, utc=None, system=1, component=100)
    sender = v2.MAVLink(None, srcSystem=1, srcComponent=154)
    silent = [(int(sent_us), v2.MAVLink_heartbeat_message(26, 8, 0, 0, 4, 3).pack(sender)) for sent_us in SENT_US]
    link = Link(in_bursts(2.0), lambda time_us: time_us + 50 * US)
    few = other.frames()[: len(other.frames()) // 2]
    flight, found = converted(link.write(tmp_path / "a.tlog", Vehicle().frames(), few, camera.frames(), silent))
    expect(flight, found)
    away_ns = flight["raw.ATTITUDE.1_100"].time_ns - SENT_US * 1_000
    assert np.abs(away_ns).max() <= 2 * MILLISECOND_NS, "the vehicle tells what the ground station's clock is off"
    away_ns = flight["raw.ATTITUDE.2_1"].time_ns - SENT_US[: ROWS // 2] * 1_000
    assert np.abs(away_ns).max() <= 2 * MILLISECOND_NS
    assert np.abs(flight["raw.HEARTBEAT.1_154"].time_ns - SENT_US * 1_000).max() <= 200 * MILLISECOND_NS


@pytest.mark.parametrize("ppm", [-80.0, 80.0])
def test_clocks_that_drift_apart_for_hours(tmp_path: Path, ppm: float) -> None:
    """Three hours: 0.9 s; values stay within a frame of when they were sent, by a vehicle without UTC."""
    sent_us = START_US + np.arange(ROWS) * 9 * US
    vehicle = Vehicle(boot=lambda time_us: round((time_us - BOOT_US) * (1 + ppm * 1e-6)), utc=None, sent=sent_us)
    flight, _found = converted(Link().write(tmp_path / "a.tlog", vehicle.frames()))
    assert np.abs(flight["ins"].time_ns - sent_us * 1_000 - DELAY_US * 1_000).max() <= 5 * MILLISECOND_NS


def test_positions_at_zero_are_none(tmp_path: Path) -> None:
    path = Link().write(tmp_path / "a.tlog", Vehicle(zeros=100).frames())
    flight, found = converted(path)
    for topic in ("ins", "gnss"):
        latitude = flight[topic].values("latitude_deg")
        assert np.isnan(latitude[:100]).all() and not np.isnan(latitude[100:]).any()
    told = [item for item in registry.read(path) if isinstance(item, Remark) and item.code == "no_position"]
    assert {item.topic: item.text.split()[1] for item in told} == {"gnss": "100", "ins": "100"}
    assert (flight["raw.GPS_RAW_INT"].values("lat")[:100] == 0).all(), "as it was sent"
    assert not any(damage["loses_data"] for damage in found.info.damages)


def test_a_packet_that_arrives_late_is_put_in_order(tmp_path: Path) -> None:
    """As over UDP: all that was sent at three instants comes 1.4 s later."""
    vehicle = Vehicle()
    frames = vehicle.frames()
    late = [frame for frame in frames if frame[0] in SENT_US[[300, 301, 302]]]
    rest = [frame for frame in frames if frame[0] not in SENT_US[[300, 301, 302]]]
    at = next(number for number, frame in enumerate(rest) if frame[0] == SENT_US[310])
    data = bytearray()
    for number, (sent_us, frame) in enumerate([*rest[:at], *late, *rest[at:]]):
        received_us = (sent_us if not at <= number < at + len(late) else SENT_US[309]) + DELAY_US
        data += int(received_us).to_bytes(8, "big") + frame
    (tmp_path / "a.tlog").write_bytes(data)
    flight, _found = converted(tmp_path / "a.tlog")
    assert np.abs(flight["ins"].time_ns - SENT_US * 1_000).max() <= MILLISECOND_NS


@pytest.mark.parametrize("size", [700, 5_000])
def test_blocks_do_not_change_when_values_are_valid(tmp_path: Path, size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.readers.tlog import reader

    path = Link(in_bursts(2.0)).write(tmp_path / "a.tlog", Vehicle().frames())

    def times() -> dict[str, list[int]]:
        found: dict[str, list[int]] = {}
        for item in reader.items(Source(path), "tlog"):
            if isinstance(item, RecordBatch) and item.validity_time_ns is not None:
                found.setdefault(item.topic, []).extend(item.validity_time_ns.tolist())
        return found

    whole = times()
    monkeypatch.setattr(reader, "BLOCK_BYTES", size)
    parts = times()
    for topic in ("raw.ATTITUDE", "raw.GPS_RAW_INT", "raw.VFR_HUD"):
        assert np.abs(np.array(parts[topic]) - whole[topic]).max() <= 400 * MILLISECOND_NS, topic
    assert parts["raw.ATTITUDE"] == whole["raw.ATTITUDE"]


@pytest.mark.parametrize("seed", range(6))
def test_times_that_are_nonsense_cost_nothing_else(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    log = Telemetry()
    for row in range(300):
        time_us = int(rng.integers(0, 1 << 63)) if row % 7 == 0 else START_US + row * 100_000
        log.add("attitude", int(rng.integers(0, 1 << 32)), 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, time_us=time_us)
        fix = (3, 55 * DEG7, 37 * DEG7, 0, 0, 0, 0, 0, 9)
        log.add("gps_raw_int", int(rng.integers(0, 1 << 63)), *fix, time_us=time_us)
        log.add("system_time", int(rng.integers(0, 1 << 63)), int(rng.integers(0, 1 << 32)), time_us=time_us)
    (tmp_path / "a.tlog").write_bytes(log.data)
    flight, _found = converted(tmp_path / "a.tlog")
    assert len(flight["gnss"]) == 300


@pytest.mark.real_log
def test_the_recorded_flight_has_its_own_rate_and_speeds(tmp_path: Path) -> None:
    found = convert_log(open_log(real_log("tlog/uavlogviewer_vtol.tlog")), tmp_path / "a.mcap")
    flight = read_flight(tmp_path / "a.mcap", found)
    gnss, entry = flight["gnss"], found.info.ledger.topics["gnss"]
    assert entry.nominal_rate_hz == pytest.approx(5.0) and entry.gaps.count <= 10, "it was 142.857 Hz and 172 gaps"
    latitude, longitude = gnss.values("latitude_deg"), gnss.values("longitude_deg")
    north_m, east_m = np.diff(latitude) * 111_320, np.diff(longitude) * 111_320 * np.cos(np.deg2rad(latitude[0]))
    implied_mps = np.hypot(north_m, east_m) / np.diff(gnss.time_ns) * 1e9
    logged_mps = np.nanmax(gnss.values("ground_speed_mps"))
    assert implied_mps.max() < 2 * logged_mps, "it was 5493 m/s"
