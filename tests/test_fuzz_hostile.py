"""Logs made to harm: bombs, names that are markup, formulas or paths, ten thousand channels, cyclic definitions."""

import csv
import gzip
import json
import struct
import time
from html.parser import HTMLParser
from pathlib import Path

import pytest
import zstandard

from groundstation.base.clock import Clock
from groundstation.base.errors import GroundstationError
from groundstation.base.ledger import Ledger
from groundstation.base.records import Damage, RecordBatch
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry
from groundstation.store.info import COPY_NAME, StoreInfo
from groundstation.store.marks import METADATA_NAME
from groundstation.store.reader import read_info
from groundstation.store.writer import StoreWriter
from tests.readers.dataflash_writer import flight_log
from tests.readers.ulog_writer import ATTITUDE, UlogWriter
from tests.store.test_store import batch_of

LIMIT_S = 60.0  # of the processor; measured: 2 to 7 s, and minutes for what is followed into a bomb
CHANNELS = 10_000
EVIL = (
    *("<script>alert(1)</script>", "'><img src=x onerror=alert(1)>", "=1+1", "@SUM(A1)", "+cmd|' /C calc'!A0", "-2+3"),
    *("../../../evil", "a/b\\c", "{{7*7}}", "\x1b[31mred\x07", "\u202eabc", "%s%n", "C:\\x", "\ufeff", "a" * 900),
)
FORMULA = ("=", "+", "-", "@", "\t", "\r")
RLE_BLOCK = struct.pack("<I", (1 << 17) << 3 | 1 << 1)[:3] + b"a"  # four bytes that become 128 KiB
ZSTD_FRAME = b"\x28\xb5\x2f\xfd\x00\x58"  # no size declared, window of 2 MiB


def hostile_csv() -> bytes:
    """A flat CSV in which every name and text is hostile."""
    quoted = [name.replace('"', '""') for name in EVIL]
    header = ["time_s", *(f'"t{at}.{name}"' for at, name in enumerate(quoted)), *(f'"{name}"' for name in quoted)]
    lines = ["# aircraft: <script>alert(1)</script>", "# flight: ../../=1+1", "# <b>key</b>: =cmd"]
    lines += [
        "# start_utc: 2026-05-04T06:00:00Z",
        ",".join([*header, "gnss.latitude_deg,gnss.longitude_deg,event.name"]),
    ]
    numbers = ",1" * 2 * len(EVIL)
    lines += [f'{at}{numbers},55,37,"{quoted[at % len(quoted)]}"' for at in range(60)]
    return ("\n".join(lines) + "\n").encode()


def hostile_ulog() -> bytes:
    """A ULog with hostile information, topics, fields, parameters and texts."""
    log = UlogWriter().flags().info("sys_name", EVIL[0]).info("ver_hw", "=1+1").info("../../x", EVIL[1])
    names = [name.replace(":", "_").replace(";", "_").replace(" ", "_") for name in EVIL]
    for at, name in enumerate(names):
        log.format(f"{name}{at}:uint64_t timestamp;float {name[:150]};").subscribe(at, f"{name}{at}")
    for row in range(20):
        for at in range(len(names)):
            log.row(at, "Qf", 1_000_000 + row * 100_000, 1.0)
        log.text(1_000_000 + row * 100_000, EVIL[row % len(EVIL)])
    return bytes(log.parameter("<b>P</b>", 1.5).data)


def hostile_dataflash() -> bytes:
    """A DataFlash log with hostile texts and a hostile type."""
    log = flight_log(3)
    for text in EVIL:
        log.write("MSG", 2_000_000, text.encode()[:60])
    log.define(77, "<b>=", "Qff", "TimeUS,=1+1,<i>x</i>")
    for row in range(30):
        log.write("<b>=", 1_200_000 + row * 1000, 1.0, 2.0)
    return log.content


class Page(HTMLParser):
    """What a browser would run or load."""

    def __init__(self) -> None:
        super().__init__()
        self.faults: list[str] = []
        self.policies: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if given.get("http-equiv") == "Content-Security-Policy":
            self.policies.append(given["content"] or "")
        is_data = tag == "script" and given.get("type") == "application/json"
        if not is_data and tag in ("script", "iframe", "object", "embed", "link", "base", "img", "form"):
            self.faults.append(tag)
        self.faults += [f"{tag} {name}" for name in given if name.startswith("on")]
        places = [value or "" for name, value in attrs if name in ("href", "src", "xlink:href")]
        self.faults += [f"{tag} {place}" for place in places if ":" in place and not place.startswith("https://")]


def assert_harmless(out: Path) -> None:
    """Nothing that runs, loads, leads elsewhere, or is a formula."""
    for path in out.rglob("*"):
        assert path.resolve().is_relative_to(out.resolve()) and not path.is_symlink()
        assert set(path.name) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.=")
        if path.suffix == ".html":
            page = Page()
            page.feed(path.read_text(encoding="utf-8"))
            own = ["script"] if path.name in ("summary.html", "report.html") else []  # ours: the policy has its digest
            assert page.faults == own and len(page.policies) == 1, page.faults
            policy = page.policies[0]
            scripts = [part.split()[1:] for part in policy.split(";") if part.split()[:1] == ["script-src"]]
            assert "default-src 'none'" in policy and len(scripts) == len(own)
            assert all(len(allowed) == 1 and allowed[0].startswith("'sha256-") for allowed in scripts)
            assert not {"\x1b", "\x07", "\u202e"} & set(path.read_text(encoding="utf-8"))
        elif path.suffix == ".csv":
            for row in csv.reader(path.read_text(encoding="utf-8").splitlines()):
                assert not any(cell.startswith(FORMULA) and not _is_number(cell) for cell in row), (path.name, row)
        elif path.suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.csv", hostile_csv), ("b.ulg", hostile_ulog), ("c.BIN", hostile_dataflash), ("=<b>&d.csv", hostile_csv)],
    ids=["csv", "ulog", "dataflash", "file-name"],
)
def test_hostile_names_reach_no_output(tmp_path: Path, name: str, content: object) -> None:
    path, out = tmp_path / name, tmp_path / "out"
    path.write_bytes(content())  # type: ignore[operator]
    (outcome,) = run_many([path], out, Configuration(), with_pdf=name == "a.csv")
    assert outcome.state in ("done", "data_lost"), outcome
    assert {entry.name for entry in tmp_path.iterdir()} == {name, "out"}
    assert_harmless(out)


@pytest.mark.parametrize("kind", ["zstd", "gzip", "zstd-frames", "gzip-members"])
def test_bombs_are_refused_in_time(tmp_path: Path, kind: str) -> None:
    content = {
        "zstd": lambda: ZSTD_FRAME + RLE_BLOCK * 262_144,  # 1 MiB that becomes 32 GiB
        "gzip": lambda: gzip.compress(bytes(100 << 20), 9),
        "zstd-frames": lambda: zstandard.compress(b"") * 400_000,
        "gzip-members": lambda: gzip.compress(b"", mtime=0) * 200_000,
    }[kind]()
    (tmp_path / "bomb").write_bytes(content)
    began = time.process_time()
    with pytest.raises(GroundstationError):
        list(registry.read(tmp_path / "bomb"))
    assert time.process_time() - began < LIMIT_S


def test_many_small_members_are_still_one_log(tmp_path: Path) -> None:
    rows = b"".join(b"%d,1\n" % row for row in range(12_000))
    pieces = [b"time_s,ins.roll_deg\n", *(rows[at : at + 1000] for at in range(0, len(rows), 1000))]
    for pack in (gzip.compress, zstandard.compress):
        (tmp_path / "log").write_bytes(b"".join(pack(piece) for piece in pieces))
        items = list(registry.read(tmp_path / "log"))
        assert sum(len(item) for item in items if isinstance(item, RecordBatch)) == 12_000
        assert not [item for item in items if isinstance(item, Damage)]


def test_cyclic_deep_and_wide_definitions(tmp_path: Path) -> None:
    log = UlogWriter().flags()
    for at in range(30):  # 18**30 fields
        log.format(f"n{at}:uint64_t timestamp;n{at + 1}[9] a;n{at + 1}[9] b;").subscribe(at, f"n{at}")
    log.format("n30:float x;").format("c:uint64_t timestamp;c other;").format("w:uint64_t timestamp;float[999999] x;")
    log.subscribe(31, "c").subscribe(32, "w").format(ATTITUDE).subscribe(40, "vehicle_attitude")
    for row in range(20):
        log.row(40, "Q4f", 1_000_000 + row * 100_000, 1, 0, 0, 0)
    (tmp_path / "log.ulg").write_bytes(bytes(log.data))
    began = time.process_time()
    items = list(registry.read(tmp_path / "log.ulg"))
    assert time.process_time() - began < LIMIT_S
    rows = sum(len(item) for item in items if isinstance(item, RecordBatch) and item.topic == "raw.vehicle_attitude")
    assert rows == 20 and any(isinstance(item, Damage) and item.kind == "dropped_channel" for item in items)


def _many_csv() -> bytes:
    header = ",".join(f"t{at}.x" for at in range(CHANNELS))
    return (f"time_s,{header}\n" + "".join(f"{row}" + f",{row}" * CHANNELS + "\n" for row in range(5))).encode()


def _many_ulog() -> bytes:
    log = UlogWriter().flags()
    for at in range(CHANNELS):
        log.format(f"t{at}:uint64_t timestamp;float x;").subscribe(at, f"t{at}")
    for row in range(3):
        for at in range(CHANNELS):
            log.row(at, "Qf", 1_000_000 + row * 100_000 + at, 1.0)
    return bytes(log.data)


@pytest.mark.parametrize("content", [_many_csv, _many_ulog], ids=["csv", "ulog"])
def test_ten_thousand_channels_are_read(tmp_path: Path, content: object) -> None:
    (tmp_path / "log").write_bytes(content())  # type: ignore[operator]
    began = time.process_time()
    topics = {item.topic for item in registry.read(tmp_path / "log") if isinstance(item, RecordBatch)}
    assert len(topics) >= CHANNELS and time.process_time() - began < LIMIT_S


@pytest.mark.slow
def test_ten_thousand_channels_become_an_mcap(tmp_path: Path) -> None:
    (tmp_path / "log").write_bytes(_many_ulog())
    convert_log(open_log(tmp_path / "log"), tmp_path / "a.mcap")
    topics = {item.topic for item in open_log(tmp_path / "a.mcap").items() if isinstance(item, RecordBatch)}
    assert len(topics) >= CHANNELS


def test_facts_of_a_crafted_mcap_have_their_shape(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ledger = {"topics": {"ins": {"rows": "x"}, "b": 3}, "damages": [1], "findings": [{"severity": "evil"}, None]}
    crafted = {Ledger: ledger, tuple: ledger["findings"], Clock: {"steps": [7], "start": "noon", "shift_s": "x"}}
    monkeypatch.setattr("groundstation.store.info.to_json_exactly", lambda value: crafted[type(value)])
    info = StoreInfo(source_name="<b>", damages=[1, {"kind": 4}], remarks=["x"], start_ns=1 << 200)
    path = tmp_path / "a.mcap"
    with StoreWriter(path, info) as writer:
        writer.write(batch_of("ins", 20))
    monkeypatch.undo()
    found = read_info(path)
    assert (found.ledger, found.clock, found.findings) == (Ledger(), Clock(), ())
    assert found.damages == found.remarks == () and found.start_ns is None
    converted = convert_log(open_log(path), tmp_path / "b.mcap")
    assert all(finding.severity in ("info", "warn", "fail") for finding in converted.findings)


def test_definitions_are_found_behind_a_damaged_start(tmp_path: Path) -> None:
    """A byte more in the first metadata record, and no summary: the definitions are searched for."""
    path = tmp_path / "a.mcap"
    with StoreWriter(path, StoreInfo(source_name="a")) as writer:
        writer.write(batch_of("ins", 200))
    data = path.read_bytes()
    at = data.index(METADATA_NAME.encode(), 44)  # behind the header
    end = data.index(COPY_NAME.encode())
    path.write_bytes(data[: at + 40] + b"x" + data[at + 40 : end])
    items = list(open_log(path).items())
    assert sum(len(item) for item in items if isinstance(item, RecordBatch) and item.topic == "ins") == 200
    assert [item.kind for item in items if isinstance(item, Damage) and item.loses_data][-1] == "truncated"
