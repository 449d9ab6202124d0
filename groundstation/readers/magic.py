"""Formats that are known by their first bytes but not read in this version."""

import re

from groundstation.readers.source import Source

_SAMPLES, _SAMPLE_BYTES = 32, 4096
_CONTROL = re.compile(rb"[\0-\x08\x0b\x0c\x0e-\x1f]")

_TAR_AT, _TAR = 257, b"ustar"
ZIP = "zip (or a spreadsheet)"
_AT_START: tuple[tuple[bytes, str], ...] = (
    (b"ULog\x01\x12\x35", "PX4 ULog"),
    (b"\xa3\x95", "ArduPilot DataFlash without its definitions"),
    (b"\x25\xeb", "IRIG 106 Chapter 10 without a whole packet header"),
    (b"\xb5\x62", "u-blox UBX without a sound frame"),
    (b"#ROSBAG", "ROS 1 bag older than version 2.0"),
    (b"SQLite format 3\0", "SQLite that is no ROS 2 bag"),
    (b"\x1f\x8b", "gzip"),
    *((b"PK" + kind, ZIP) for kind in (b"\x03\x04", b"\x05\x06", b"\x07\x08")),
    (b"7z\xbc\xaf\x27\x1c", "7z"),
    (b"Rar!\x1a\x07", "RAR"),
    (b"\x28\xb5\x2f\xfd", "zstd"),
    (b"BZh", "bzip2"),
    (b"\xfd7zXZ\0", "xz"),
    (b"\x89HDF\r\n\x1a\n", "HDF5 (or MATLAB 7.3)"),
    (b"MATLAB 5.0", "MATLAB 5"),
    (b"PAR1", "Parquet"),
)


HOLD_FILES = (ZIP, "tar", "7z", "RAR")  # archives in which a log may stand uncompressed, between their own bytes
UNPACK = {  # archives that are not opened -> next step
    ZIP: "unpack it and give the log inside, or save the spreadsheet as CSV",
    "tar": "unpack it (tar -xf) and give the logs inside",
    "7z": "unpack it and give the log inside",
    "RAR": "unpack it and give the log inside",
    "bzip2": "unpack it (bunzip2) and give the log; gzip and zstd are read as they are",
    "xz": "unpack it (unxz) and give the log; gzip and zstd are read as they are",
}


def recognise(source: Source) -> str | None:
    """Return the format that a file's first bytes show, None when they show none."""
    if source.head.startswith(_TAR, _TAR_AT):
        return "tar"
    return next((name for magic, name in _AT_START if source.head.startswith(magic)), None)


def is_archive(source: Source) -> bool:
    """Tell whether a file is an archive; a log stored in one is not the file itself."""
    return recognise(source) in HOLD_FILES


def companion(source: Source) -> str | None:
    """Name a file that belongs to a log and is no log itself; None for any other.

    RTKLIB writes a file beside the log it records that tells when its bytes came: ``TIMETAG RTKLIB`` and its version,
    60 bytes.
    """
    if not source.head.startswith(b"TIMETAG RTKLIB"):
        return None
    name = source.name.removesuffix(".tag")
    return f"an RTKLIB time tag of {name if name != source.name else 'a log'}, no log"


def is_mostly_text(source: Source) -> bool:
    """Tell whether most of the head is lines without control characters.

    The first bytes do not matter; samples of the head are looked at.
    """
    step = max(_SAMPLE_BYTES, len(source.head) // _SAMPLES)
    sample = b"".join(source.head[at : at + _SAMPLE_BYTES] + b"\n" for at in range(0, len(source.head), step))
    text = sum(len(line) + 1 for line in sample.split(b"\n") if not _CONTROL.search(line))
    return 2 * text > len(sample)


def is_binary(source: Source) -> bool:
    """Tell whether the head is no text: it has NUL bytes, or many control characters."""
    sample = source.head[:4096]
    control = sum(byte < 32 and byte not in (9, 10, 12, 13) for byte in sample)
    return b"\0" in sample or control * 20 > len(sample)


def is_wide_text(source: Source) -> bool:
    """Tell whether the head looks like UTF-16 without its mark: every other byte is zero."""
    sample = source.head[:4096]
    zeros = [sample[start::2].count(0) for start in (0, 1)]
    is_every_other = len(sample) > 3 and max(zeros) > 0.8 * len(sample) / 2 and min(zeros) < 0.02 * len(sample)
    return is_every_other and not _CONTROL.search(sample.replace(b"\0", b""))
