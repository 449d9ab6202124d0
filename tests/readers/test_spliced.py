"""The beginning or a part of another log inside a file: the content decides whose the file is."""

import gzip
from pathlib import Path

import pytest
import zstandard

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, RecordBatch
from groundstation.readers import registry
from groundstation.readers.magic import is_mostly_text
from groundstation.readers.source import Source
from tests.fuzz.bases import dataflash, flat_csv, g1000, ulog

CSV_ROWS = 400
BINARY = {"px4-ulog": ulog(), "dataflash": dataflash()}
TEXT = {"flat-csv": flat_csv(), "csv-profile": g1000()}


def read(path: Path, data: bytes) -> tuple[str, int, list[Damage]]:
    """Reader, rows of its largest topic, damages."""
    path.write_bytes(data)
    rows: dict[str, int] = {}
    damages = []
    for item in registry.read(path):
        if isinstance(item, RecordBatch):
            rows[item.topic] = rows.get(item.topic, 0) + len(item)
        elif isinstance(item, Damage):
            damages.append(item)
    return registry.identify(path).reader, max(rows.values(), default=0), damages


@pytest.mark.parametrize("other", BINARY)
@pytest.mark.parametrize("length", [300, 1000, 4000])
def test_the_beginning_of_a_binary_log_before_a_flat_csv(tmp_path: Path, other: str, length: int) -> None:
    reader, rows, damages = read(tmp_path / "a", BINARY[other][:length] + b"\n" + TEXT["flat-csv"])
    assert (reader, rows) == ("flat-csv", CSV_ROWS)
    assert "lines above the header row" in damages[0].what and damages[0].loses_data


@pytest.mark.parametrize("other", BINARY)
def test_a_part_of_a_binary_log_in_the_metadata(tmp_path: Path, other: str) -> None:
    csv = TEXT["flat-csv"]
    reader, rows, _ = read(tmp_path / "a", csv[:30] + BINARY[other][:2000] + csv[30:])
    assert (reader, rows) == ("flat-csv", CSV_ROWS)


@pytest.mark.parametrize("other", BINARY)
@pytest.mark.parametrize("reader", TEXT)
def test_a_part_of_a_binary_log_behind_a_table(tmp_path: Path, reader: str, other: str) -> None:
    assert read(tmp_path / "a", TEXT[reader] + BINARY[other][:5000])[:2] == (reader, CSV_ROWS)


@pytest.mark.parametrize("reader", BINARY)
@pytest.mark.parametrize("other", TEXT)
def test_a_part_of_a_table_in_a_binary_log(tmp_path: Path, reader: str, other: str) -> None:
    log = BINARY[reader]
    whole = read(tmp_path / "a", log)[1]
    assert read(tmp_path / "a", log + TEXT[other][:3000])[0] == reader
    found, rows, _ = read(tmp_path / "a", TEXT[other][:3000] + log)
    assert found == reader and rows > 0.9 * whole


def test_the_first_bytes_of_a_ulog_before_a_dataflash_log(tmp_path: Path) -> None:
    """The format that they claim has no record."""
    whole = read(tmp_path / "a", BINARY["dataflash"])[1]
    assert read(tmp_path / "a", BINARY["px4-ulog"][:16] + BINARY["dataflash"])[:2] == ("dataflash", whole)


@pytest.mark.parametrize("magic", [b"\x1f\x8b\x08", b"\x28\xb5\x2f\xfd"])
def test_the_first_bytes_of_a_compressed_file_before_a_log(tmp_path: Path, magic: bytes) -> None:
    assert read(tmp_path / "a", magic + b"\n" + TEXT["flat-csv"])[:2] == ("flat-csv", CSV_ROWS)


def test_compressed_logs_are_still_told_by_their_content(tmp_path: Path) -> None:
    for kind, pack in (("gzip", gzip.compress), ("zstd", zstandard.compress)):
        (tmp_path / "a").write_bytes(pack(TEXT["flat-csv"]))
        assert Source(tmp_path / "a").compression == kind
        assert registry.identify(tmp_path / "a").reader == "flat-csv"


def test_prose_with_an_example_of_a_table_is_no_log(tmp_path: Path) -> None:
    example = "".join(TEXT["flat-csv"].decode().splitlines(keepends=True)[2:8])
    prose = "".join(f"Line {at} of a page about recorders, which have clocks.\n" for at in range(9))
    for text in (f"# Formats\n\n{prose}\n{example}\n{prose}", f"{prose}{example.splitlines()[0]}\n"):
        (tmp_path / "a").write_text(text)
        with pytest.raises(UnreadableLogError, match="no reader claims"):
            registry.identify(tmp_path / "a")


def test_binary_noise_with_a_header_row_in_it_is_no_log(tmp_path: Path) -> None:
    header = TEXT["flat-csv"].splitlines(keepends=True)[2]
    (tmp_path / "a").write_bytes(bytes(range(256)) * 40 + b"\n" + header + bytes(range(256)) * 40)
    with pytest.raises(UnreadableLogError, match="unknown format"):
        registry.identify(tmp_path / "a")


def test_what_is_mostly_text(tmp_path: Path) -> None:
    for reader, log in {**BINARY, **TEXT}.items():
        (tmp_path / "a").write_bytes(log)
        assert is_mostly_text(Source(tmp_path / "a")) == (reader in TEXT)
