"""Time tags of RTKLIB: UTC of a log without a clock of its own, from writes of the host with known truth."""

import struct
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.verbs.profiles import new_profile
from groundstation.readers import profile_file as profiles
from groundstation.readers import registry
from groundstation.readers.rtklib_tag import tag_of
from tests.readers.test_flat_csv import Read
from tests.real_logs import REAL_LOGS

START_UTC = "2025-07-08T19:34:00Z"
LEAP_S = 18  # of GPS time in 2025
TICK_MS = 15.625  # of the host's timer
PROFILE = """
name = "tagged"
[recognise]
names = ["gz", "ms"]
[time]
kind = "seconds"
column = "ms"
unit = "ms"
rtklib_tag = true
[columns]
"gz" = { field = "imu.rate_z_dps", unit = "dps" }
"""
WHOLE_S, STEP_MS, FIRST_MS = 120.0, 10, 261_906
DRIFT = 50e-6  # seconds of the host for a second of the device, less 1


def written(
    folder: Path, *, wide: bool = False, ends: str = "\n", counted: str = "\r\n", late_ms: float = 0.0
) -> tuple[Path, Path]:
    """A log and its tag; the host writes each row within one step of its timer."""
    count = round(WHOLE_S * 1000.0 / STEP_MS)
    rows = [f"{0.5 + k % 7},{FIRST_MS + STEP_MS * k}" for k in range(count)]
    log, settings = folder / "imu.csv", folder / "my.toml"
    log.write_bytes("".join(row + ends for row in rows).encode())
    settings.write_text(PROFILE, encoding="utf-8")
    lengths = np.cumsum([len(row) + len(counted) for row in rows])
    true_ms = 500.0 + (1.0 + DRIFT) * STEP_MS * np.arange(count)  # since the start of the host's file
    ticks = np.floor((true_ms + late_ms * (np.arange(count) == 77)) / TICK_MS + 0.5) * TICK_MS
    last = np.flatnonzero(np.append(np.diff(ticks) > 0.0, True))  # writes of several rows at once
    second = iso_to_utc_ns(START_UTC)[0] // NS_PER_S + LEAP_S
    head = b"TIMETAG RTKLIB demo5".ljust(64, b"\0") + struct.pack("<Id", second, 0.25)
    kind = "<IQ" if wide else "<II"
    ticks = np.maximum.accumulate(ticks)
    body = b"".join(struct.pack(kind, int(ticks[at]), int(lengths[at])) for at in last)
    (folder / "imu.csv.tag").write_bytes(head + body)
    return log, settings


def utc_ns(read: Read) -> np.ndarray:
    assert read.header.utc_of_zero_ns is not None
    times = [batch.validity_time_ns for batch in read.batches if batch.topic == "imu"]
    return np.concatenate([time for time in times if time is not None]) + read.header.utc_of_zero_ns


def truth_ns(count: int) -> np.ndarray:
    since_s = 0.25 + 0.5 + (1.0 + DRIFT) * STEP_MS / 1000.0 * np.arange(count)
    return iso_to_utc_ns(START_UTC)[0] + np.rint(since_s * NS_PER_S).astype(np.int64)


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize(("ends", "counted"), [("\n", "\r\n"), ("\r\n", "\r\n"), ("\n", "\n")])
def test_rows_get_utc_by_the_writes_of_the_host(tmp_path: Path, wide: bool, ends: str, counted: str) -> None:
    read = Read(*written(tmp_path, wide=wide, ends=ends, counted=counted))
    found = utc_ns(read)
    assert len(found) == WHOLE_S * 1000.0 / STEP_MS
    assert np.abs(found - truth_ns(len(found))).max() < 1_000_000  # a fifteenth of the timer's step
    assert read.times("imu")[0] == FIRST_MS * 1_000_000
    assert "scatter by 4." in read.remarks["time_tag"].text and "50 ppm slow" in read.remarks["time_tag"].text


def test_a_draft_takes_the_tag_beside_its_table(tmp_path: Path) -> None:
    log, _settings = written(tmp_path)
    draft = new_profile(log, ("ax", "ms"))
    assert "rtklib_tag = true" in draft.text and "UTC by imu.csv.tag" in draft.time.why
    (tmp_path / "imu.csv.tag").write_bytes(b"no tag of RTKLIB")
    assert "rtklib_tag" not in new_profile(log, ("ax", "ms")).text


def test_a_table_without_names_asks_for_them(tmp_path: Path) -> None:
    table = tmp_path / "a.csv"
    table.write_text("".join(f"{k % 3},{(7 * k) % 5}\n" for k in range(40)), encoding="utf-8")
    with pytest.raises(UnreadableLogError, match=r"--names ax,ay,az,time_ms"):
        new_profile(table)


def test_a_host_that_hung_once_changes_nothing(tmp_path: Path) -> None:
    found = utc_ns(Read(*written(tmp_path, late_ms=900.0)))
    assert np.abs(found - truth_ns(len(found))).max() < 1_000_000


def test_without_a_tag_there_is_no_absolute_time(tmp_path: Path) -> None:
    log, settings = written(tmp_path)
    tag = log.with_name("imu.csv.tag")
    for content in (b"TIMETAG RTKLIB", b"\0" * 500, tag.read_bytes()[:100], b""):
        tag.write_bytes(content)
        read = Read(log, settings)
        assert read.header.utc_of_zero_ns is None and "is no time tag" in read.remarks["time_tag"].text
    tag.unlink()
    read = Read(log, settings)
    assert read.header.utc_of_zero_ns is None and "is not there" in read.remarks["time_tag"].text
    assert len(read.times("imu")) == WHOLE_S * 1000.0 / STEP_MS


def test_a_tag_of_another_log_tells_nothing(tmp_path: Path) -> None:
    log, settings = written(tmp_path)
    path = log.with_name("imu.csv.tag")
    content = path.read_bytes()
    writes = np.frombuffer(content, "<u4", offset=76).reshape(-1, 2).copy()
    for lengths in (3 * writes[:, 1], writes[:, 1] + 10**8):  # of a log with longer rows; of one behind it
        path.write_bytes(content[:76] + np.column_stack((writes[:, 0], lengths)).astype("<u4").tobytes())
        read = Read(log, settings)
        assert read.header.utc_of_zero_ns is None and "does not fit imu.csv" in read.remarks["time_tag"].text


def test_ticks_that_go_back_are_no_tag() -> None:
    head = b"TIMETAG RTKLIB".ljust(64, b"\0") + struct.pack("<Id", 1_752_003_261, 0.5)
    values = [(100 * k, 40 * k) for k in range(20)]
    assert tag_of(head + b"".join(struct.pack("<II", *one) for one in values)) is not None
    assert tag_of(head + b"".join(struct.pack("<II", *one) for one in reversed(values))) is None


def test_the_key_stands_with_seconds_only(tmp_path: Path) -> None:
    settings = tmp_path / "my.toml"
    settings.write_text(PROFILE.replace('kind = "seconds"', 'kind = "iso"').replace('unit = "ms"\n', ""), "utf-8")
    with pytest.raises(Exception, match="rtklib_tag"):
        profiles.load(settings)


@pytest.mark.parametrize(("name", "first"), [("drive_0708_imu_1934", 261_906), ("walk_0827_imu_1730", 3_326_345)])
def test_recorded_tags(tmp_path: Path, name: str, first: int) -> None:
    log = REAL_LOGS / "gnss" / f"{name}.csv"
    if not log.is_file():
        pytest.skip(f"{log.name} is not here: set GROUNDSTATION_REAL_LOGS")
    settings = tmp_path / "my.toml"
    names = "[" + ", ".join(f'"{at}"' for at in ("ax", "ay", "az", "gx", "gy", "gz", "ms")) + "]"
    settings.write_text(PROFILE.replace('["gz", "ms"]', names), encoding="utf-8")
    read = Read(log, settings)
    assert read.times("imu")[0] == first * 1_000_000
    assert "scatter by 4.6 ms" in read.remarks["time_tag"].text
    assert registry.identify(log, settings).title == "csv-profile tagged"
