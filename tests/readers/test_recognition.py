"""A claim needs plausible values over many records: no reader of tables or trajectories takes what is none."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError, UnclaimedLogError
from groundstation.readers import csv_profile, flat_csv, registry, rtklib_pos, sbet
from groundstation.readers.sbet import RECORD
from groundstation.readers.source import Source
from tests.readers.trajectory_writer import sbet as flown
from tests.real_logs import REAL_LOGS, real_log

READERS = (csv_profile, flat_csv, rtklib_pos, sbet)
N = 60_000
KINDS = ("i1", "u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f4", "<f8")
FACTORS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 17.0)


def claims(path: Path) -> list[str]:
    source = Source(path)
    found = []
    for reader in READERS:
        try:
            found += [reader.NAME] if reader.sniff(source) is not None else []
        except GroundstationError:
            continue
    return found


def records(**columns: object) -> bytes:
    """Records of 17 doubles."""
    made = np.zeros(2000, RECORD)
    for name, values in columns.items():
        made[name] = values
    return made.tobytes()


COUNT = np.arange(N)
RANDOM = np.random.default_rng(7)
SYNTHETIC: dict[str, Callable[[], bytes]] = {
    **{f"counter {kind}": lambda kind=kind: COUNT.astype(kind).tobytes() for kind in KINDS},
    **{
        f"counter by 2500 {kind}": lambda kind=kind: (COUNT * 2500 + 10**6).astype(kind).tobytes() for kind in KINDS[2:]
    },
    **{f"constant {kind}": lambda kind=kind: np.full(N, 7).astype(kind).tobytes() for kind in KINDS},
    **{f"ramp {one}": lambda one=one: (COUNT * one).tobytes() for one in FACTORS},
    **{f"ramp down {one}": lambda one=one: (1e5 - COUNT * one).tobytes() for one in FACTORS},
    **{f"ramp of floats {one}": lambda one=one: (COUNT * one).astype("<f4").tobytes() for one in FACTORS},
    "zeros": lambda: bytes(8 * N),
    "ones": lambda: b"\xff" * 8 * N,
    "random bytes": lambda: RANDOM.integers(0, 256, 8 * N, dtype=np.uint8).tobytes(),
    "random numbers": lambda: RANDOM.uniform(-1.0, 1.0, N).tobytes(),
    "noise": lambda: RANDOM.normal(size=N).tobytes(),
    "a slow sine": lambda: np.sin(COUNT * 1e-4).tobytes(),
    "denormal numbers": lambda: (COUNT * 5e-324).tobytes(),
    "pairs of counters": lambda: np.stack([COUNT * 15, COUNT * 40], axis=1).astype("<u4").tobytes(),
    "times and noise": lambda: records(
        time=1000.0 + np.arange(2000) * 0.005,
        **{name: RANDOM.uniform(-1.0, 1.0, 2000) for name in (RECORD.names or ())[1:]},
    ),
    "times and constants": lambda: records(
        time=1000.0 + np.arange(2000) * 0.005, **dict.fromkeys((RECORD.names or ())[1:], 0.3)
    ),
    "times and zeros": lambda: records(time=1000.0 + np.arange(2000) * 0.005),
    "accuracies": lambda: np.full((5000, 10), 0.03).tobytes(),
    "text of another program": lambda: b"".join(
        b"2024-05-06 10:00:00.%03d INFO fix 3D\n" % (k % 1000) for k in range(2000)
    ),
    "a table of numbers": lambda: b"".join(b"%d 47.1 8.2 400.0 1 9\n" % k for k in range(2000)),
    "a comment": lambda: b"% program : something else\n% time lat lon\n" * 500,
    "a table of names": lambda: b"time,lat,lon,heading\n" + b"1,47,8,90\n" * 500,
}


@pytest.mark.parametrize("name", SYNTHETIC)
def test_what_is_no_log_of_ours_is_not_claimed(tmp_path: Path, name: str) -> None:
    path = tmp_path / "file.bin"
    path.write_bytes(SYNTHETIC[name]())
    assert claims(path) == []


@given(st.integers(0, 2**32), st.sampled_from(KINDS), st.sampled_from([1, 3, 8, 1000]), st.integers(0, 200))
@settings(max_examples=60, deadline=None)
def test_counters_behind_a_head_of_any_length(
    tmp_path_factory: pytest.TempPathFactory, start: int, kind: str, step: int, head: int
) -> None:
    path = tmp_path_factory.mktemp("r") / "file.bin"
    with np.errstate(invalid="ignore"):  # a counter beyond its type is any number
        counted = (np.arange(4000, dtype=np.float64) * step + start).astype(kind)
    path.write_bytes(bytes(head) + counted.tobytes())
    assert claims(path) == []


def sbet_of(content: NDArray[np.void], tmp_path: Path, head: bytes = b"") -> list[str]:
    path = tmp_path / "sbet_20250828.out"
    path.write_bytes(head + content.tobytes())
    return claims(path)


@pytest.mark.parametrize("count", [5, 60, 401, 3000])
def test_a_trajectory_is_claimed(tmp_path: Path, count: int) -> None:
    assert sbet_of(flown(count=count), tmp_path) == ["sbet"]


def test_a_beginning_alone_is_not_enough(tmp_path: Path) -> None:
    """A flight of ten seconds before as many bytes of something else: neither middle nor end is a trajectory."""
    other = np.frombuffer(RANDOM.integers(0, 256, 20_000 * RECORD.itemsize, dtype=np.uint8).tobytes(), RECORD)
    assert sbet_of(np.concatenate([flown(count=2000), other]), tmp_path) == []
    assert sbet_of(np.concatenate([flown(count=2000), np.zeros(1500, RECORD)]), tmp_path) == ["sbet"]  # cut off


def test_a_trajectory_that_is_moved_by_a_few_bytes_in_its_middle(tmp_path: Path) -> None:
    content = flown(count=3000).tobytes()
    path = tmp_path / "sbet_20250828.out"
    at = 1000 * RECORD.itemsize
    path.write_bytes(content[:at] + b"\x55" * 7 + content[at:])
    assert claims(path) == ["sbet"]


@pytest.mark.parametrize(
    "change",
    [
        {"latitude": lambda one: one * 0.0 + 1e-310},
        {"time": lambda one: one - one + 5.0},
        {"time": lambda one: one[::-1].copy()},
        {"latitude": lambda one: one * 50.0},
        {"x_velocity": lambda one: one + 2000.0},
        {"z_acceleration": lambda one: one * 1e6},
        {"x_rate": lambda one: one + np.nan},
        {"longitude": lambda one: one + np.arange(len(one)) * 1e-3},
    ],
)
def test_what_no_vehicle_does(tmp_path: Path, change: dict[str, Callable[[NDArray[np.float64]], object]]) -> None:
    content = flown(count=1000)
    for name, made in change.items():
        content[name] = made(content[name])
    assert sbet_of(content, tmp_path) == []


@pytest.mark.parametrize("name", ["log.ubx.tag", "log.tag", "renamed.bin"])
def test_a_time_tag_is_named(tmp_path: Path, name: str) -> None:
    head = b"TIMETAG RTKLIB demo5".ljust(60, b"\0") + np.array([7], "<u4").tobytes()
    path = tmp_path / name
    path.write_bytes(
        head + np.array([1_720_000_000], "<u4").tobytes() + np.array([0.5]).tobytes() + COUNT.astype("<u4").tobytes()
    )
    with pytest.raises(UnclaimedLogError) as caught:
        registry.identify(path)
    of = {"log.ubx.tag": "log.ubx", "log.tag": "log", "renamed.bin": "a log"}[name]
    assert f"an RTKLIB time tag of {of}, no log" in str(caught.value) and claims(path) == []


@pytest.mark.real_log
def test_recorded_files_have_no_other_claims() -> None:
    """No recorded log of another format is claimed, nor a file that is none."""
    real_log("gnss/drive_0708_imu_1934.csv.tag")
    expected = {
        "g1000": {"csv-profile"},
        **{folder: {"flat-csv"} for folder in ("fixedwing", "inertial")},
        "reference_heading": {"flat-csv", "csv-profile"},  # increments of an IMU
        "gnss": {"rtklib-pos"},
        **{folder: {"csv-profile", "flat-csv", "rtklib-pos"} for folder in ("cases", "reliability", "damaged")},
    }
    found = {
        path.relative_to(REAL_LOGS): set(names)
        for path in sorted(REAL_LOGS.rglob("*"))
        if path.is_file() and (names := claims(path))
    }
    wrong = {path: names for path, names in found.items() if not names <= expected.get(path.parent.name, set())}
    assert not wrong and not [path for path, names in found.items() if len(names) > 1 or "sbet" in names]
