"""Formats are found by content; what cannot be read is refused in one clear line; plug-ins cannot break a run."""

import tarfile
import zipfile
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Item, LogHeader, Remark
from groundstation.readers import registry
from groundstation.readers.source import Claim, Source
from tests.readers.ulog_writer import small_flight
from tests.real_logs import real_log

MAGICS = [
    (b"\xa3\x95\x80\x80" + bytes(20), "ArduPilot DataFlash"),
    (b"\x25\xeb\x00\x00" + bytes(20), "Chapter 10"),
    (b"\xb5\x62\x01\x07" + bytes(20), "UBX"),
    (b"#ROSBAG V1.2\n", "ROS 1 bag older"),
    (b"SQLite format 3\0" + bytes(20), "SQLite"),
    (b"PK\x03\x04" + bytes(20), "zip"),
]


def refusal(path: Path) -> str:
    with pytest.raises(UnreadableLogError) as caught:
        registry.identify(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(("content", "name"), MAGICS, ids=[name for _, name in MAGICS])
def test_known_formats_are_named(tmp_path: Path, content: bytes, name: str) -> None:
    path = tmp_path / "log.csv"  # the name means nothing
    path.write_bytes(content)
    text = refusal(path)
    assert f"recognised as {name}" in text or name in text
    assert "not readable in this version" in text and "log.csv" in text


@pytest.mark.parametrize("content", [b"PK\x03\x04", b"BZh9", b"\xfd7zXZ\0"], ids=["zip", "bzip2", "xz"])
def test_an_archive_that_is_not_opened_is_to_be_unpacked(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "log.ulg").write_bytes(content + bytes(20))
    text = refusal(tmp_path / "log.ulg")
    assert "unpack it" in text and "flat CSV" not in text


@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED], ids=["stored", "deflated"])
@pytest.mark.parametrize("kind", ["ulog", "csv"])
def test_a_log_in_a_zip_is_refused_however_it_is_packed(tmp_path: Path, kind: str, compression: int) -> None:
    """A stored log begins behind the zip's own bytes: no reader takes these for damage of the log."""
    with zipfile.ZipFile(tmp_path / "logs.zip", "w", compression) as packed:
        packed.writestr("log", plain_log(kind))
    text = refusal(tmp_path / "logs.zip")
    assert "recognised as zip" in text and "unpack it and give the log inside" in text
    assert registry.unclaimed(tmp_path / "logs.zip") is not None


@pytest.mark.parametrize("kind", ["ulog", "csv"])
def test_a_tar_is_refused_like_a_zip(tmp_path: Path, kind: str) -> None:
    (tmp_path / "log").write_bytes(plain_log(kind))
    for name, mode in (("logs.tar", "w"), ("logs.tar.gz", "w:gz")):
        with tarfile.open(tmp_path / name, mode) as packed:  # type: ignore[call-overload]
            packed.add(tmp_path / "log", "log")
        assert "recognised as tar" in refusal(tmp_path / name)


def plain_log(kind: str) -> bytes:
    """A short log that its reader claims."""
    if kind == "csv":
        return b"time_s,ins.roll_deg\n" + b"".join(b"%d,1.0\n" % row for row in range(200))
    return bytes(small_flight().data)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "empty"),
        (bytes(range(256)) * 20, "binary data of an unknown format"),
        (b"Dear diary,\nnothing happened.\n", "no reader claims"),
        (b"t,x\n1,2\n", "--profile"),
        (b"ins.roll_deg,ins.pitch_deg\n1,2\n", "no time column"),
    ],
)
def test_unknown_content_is_refused_in_one_line(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "log.bin"
    path.write_bytes(content)
    assert expected in refusal(path)


def test_absent_files_and_folders(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "nothing.csv")
    assert "directory" in refusal(tmp_path)


def test_read_refuses_at_once(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"")
    with pytest.raises(UnreadableLogError):
        registry.read(tmp_path / "a")


def test_the_flat_csv_is_claimed_whatever_its_name(tmp_path: Path) -> None:
    path = tmp_path / "flight.dat"
    path.write_text("time_s,ins.roll_deg\n1,2\n")
    assert registry.identify(path) == Claim("flat-csv", "", 0.9)
    assert registry.identify(str(path)).title == "flat-csv"


def test_formats_are_listed() -> None:
    found = {entry.name: entry for entry in registry.formats()}
    assert {"flat-csv", "csv-profile"} <= found.keys()
    assert all(entry.summary and "\n" not in entry.summary for entry in found.values())


class Diary:
    """Diaries."""

    NAME = "diary"

    def sniff(self, source: Source) -> Claim | None:
        return Claim("my diary") if source.head.startswith(b"Dear diary") else None

    def read(self, source: Source) -> Iterator[Item]:
        yield LogHeader("diary")
        yield Remark("mood", "good")


class Broken(Diary):
    NAME = "broken"

    def sniff(self, source: Source) -> Claim | None:
        raise ValueError("oh\nno")


class BreaksLate(Diary):
    NAME = "late"

    def read(self, source: Source) -> Iterator[Item]:
        yield LogHeader("late")
        raise IndexError("row 7")


class Unloadable:
    def load(self) -> Any:
        raise ImportError("no module named antigravity")

    name, value = "unloadable", "antigravity"


class Loaded:
    def __init__(self, reader: Any, name: str = "plug", value: str = "plug.reader") -> None:
        self._reader, self.name, self.value = reader, name, value

    def load(self) -> Any:
        return self._reader


@pytest.fixture
def plug_ins(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    entries: list[Any] = []
    monkeypatch.setattr("groundstation.base.plug_ins.entry_points_of", lambda group: entries)
    registry._plug_ins.cache_clear()
    yield entries
    registry._plug_ins.cache_clear()


@pytest.fixture
def diary(tmp_path: Path) -> Path:
    path = tmp_path / "diary.txt"
    path.write_text("Dear diary,\n")
    return path


def test_builtins_work_without_entry_points(plug_ins: list[Any], tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time_s,ins.roll_deg\n1,2\n")
    assert registry.identify(path).reader == "flat-csv"


def test_a_plug_in_reads(plug_ins: list[Any], diary: Path) -> None:
    plug_ins.append(Loaded(Diary()))
    assert registry.identify(diary).reader == "diary"
    assert [type(item) for item in registry.read(diary)] == [LogHeader, Remark]
    assert registry.formats()[-1] == registry.Format("diary", "Diaries.", "plug-in")


@pytest.mark.parametrize("broken", [Loaded(Broken()), Unloadable(), Loaded(object()), Loaded(Diary(), "x", "y")])
def test_a_broken_plug_in_is_one_line(plug_ins: list[Any], tmp_path: Path, broken: Any) -> None:
    if isinstance(broken, Loaded) and broken.name == "x":
        plug_ins.append(Loaded(Diary()))  # two of one name
    plug_ins.append(broken)
    path = tmp_path / "a.csv"
    path.write_text("time_s,ins.roll_deg\n1,2\n")
    remarks = [item for item in registry.read(path) if isinstance(item, Remark)]
    assert [remark.code for remark in remarks] == ["plug_in"] and "\n" not in remarks[0].text
    path.write_text("nothing known")
    assert "plug-in" in refusal(path)


def test_a_plug_in_that_breaks_while_reading(plug_ins: list[Any], diary: Path) -> None:
    plug_ins.append(Loaded(BreaksLate()))
    with pytest.raises(UnreadableLogError, match=r"reader 'late' failed \(IndexError: row 7\)"):
        list(registry.read(diary))


def test_our_own_entry_point_is_not_a_plug_in(plug_ins: list[Any]) -> None:
    group = registry.ENTRY_POINT_GROUP
    plug_ins.append(EntryPoint("flat_csv", "groundstation.readers.flat_csv", group))
    assert registry.plug_in_failures() == () and all(entry.origin == "built in" for entry in registry.formats())


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("damaged/log_220414_065328______EMPTY.csv", "empty"),
        ("inertial/gv_rf15_attitude_error.csv", "no profile claims"),  # PROVENANCE: not in the flat CSV
    ],
)
def test_recorded_logs_of_other_formats_are_named(name: str, expected: str) -> None:
    assert expected in refusal(real_log(name))
