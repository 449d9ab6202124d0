"""NovAtel logs as text (``#BESTPOSA,...;...*CRC``), converted to their binary form.

The same layouts read that form. Names of enumerations become their numbers, hexadecimal words numbers. A log that its
layout does not fit keeps its text.

Source: NovAtel, OEM7 commands and logs reference manual, ASCII and short ASCII headers; names of the database of
novatel_edie (MIT).
"""

import re
import struct
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.readers.receiver import scan
from groundstation.readers.receiver.novatel_messages import LAYOUTS
from groundstation.readers.receiver.stream import Frames

HEADER = struct.Struct("<3sBHBBHHBBHI8s")  # binary header: header, number, kind ... time status, week, milliseconds
KEPT = "-text"  # added to the name of a log whose text is kept
_TIME_STATUS = {"UNKNOWN": 20, "APPROXIMATE": 60, "COARSEADJUSTING": 80, "COARSE": 100, "COARSESTEERING": 120}
_TIME_STATUS |= {"FREEWHEELING": 130, "FINEADJUSTING": 140, "FINE": 160, "FINEBACKUPSTEERING": 170}
_TIME_STATUS |= {"FINESTEERING": 180, "SATTIME": 200}
_SHORT_STATUS = 180  # short headers do not tell it


def _numbered(text: str, first: int = 0) -> dict[str, int]:
    """Number names in their order; ``=16`` continues with that number."""
    found, number = {}, first
    for word in text.split():
        name, _, told = word.partition("=")
        number = int(told) if told else number
        found[name] = number
        number += 1
    return found


_SOLUTION = _numbered(
    "SOL_COMPUTED INSUFFICIENT_OBS NO_CONVERGENCE SINGULARITY COV_TRACE TEST_DIST COLD_START V_H_LIMIT VARIANCE "
    "RESIDUALS DELTA_POS NEGATIVE_VAR OLD_SOLUTION INTEGRITY_WARNING PENDING=18 INVALID_FIX UNAUTHORIZED "
    "ANTENNA_WARNING INVALID_RATE"
)
_POSITION = _numbered(
    "NONE FIXEDPOS FIXEDHEIGHT FIXEDVEL FLOATCONV WIDELANE NARROWLANE DOPPLER_VELOCITY=8 SINGLE=16 PSRDIFF WAAS "
    "PROPAGATED OMNISTAR L1_FLOAT=32 IONOFREE_FLOAT NARROW_FLOAT L1L2_FLOAT L1L2_INT=46 L1L2_INT_VERIFIED L1_INT "
    "WIDE_INT NARROW_INT RTK_DIRECT_INS INS_SBAS INS_PSRSP INS_PSRDIFF INS_RTKFLOAT INS_RTKFIXED INS_OMNISTAR "
    "INS_OMNISTAR_HP INS_OMNISTAR_XP OMNISTAR_HP=64 OMNISTAR_XP CDGPS EXT_CONSTRAINED PPP_CONVERGING PPP OPERATIONAL "
    "WARNING OUT_OF_BOUNDS INS_PPP_CONVERGING INS_PPP PPP_PLUS INS_PPP_PLUS PPP_BASIC_CONVERGING PPP_BASIC "
    "INS_PPP_BASIC_CONVERGING INS_PPP_BASIC"
)
_INS = _numbered(
    "INS_INACTIVE INS_ALIGNING INS_HIGH_VARIANCE INS_SOLUTION_GOOD INS_TEST_ALIGNING INS_TEST_SOLUTION_GOOD "
    "INS_SOLUTION_FREE INS_ALIGNMENT_COMPLETE DETERMINING_ORIENTATION WAITING_INITIALPOS WAITING_AZIMUTH "
    "INITIALIZING_BIASES MOTION_DETECT TIMEOUT WAITING_ALIGNMENTORIENTATION"
)
_DATUM = _numbered(
    "ADIND ARC50 ARC60 AGD66 AGD84 BUKIT ASTRO CHATM CARTH CAPE DJAKA EGYPT ED50 ED79 GUNSG GEO49 GRB36 GUAM HAWAII "
    "KAUAI MAUI OAHU HERAT HJORS HONGK HUTZU INDIA IRE65 KERTA KANDA LIBER LUZON MINDA MERCH NAHR NAD83 CANADA ALASKA "
    "NAD27 CARIBB MEXICO CAMER MINNA OMAN PUERTO QORNO ROME CHUA SAM56 SAM69 CAMPO SACOR YACAR TANAN TIMBA TOKYO TRIST "
    "VITI WAK60 WGS72 WGS84 ZANDE USER CSRS PE90=88",
    1,
)
_CLOCK = _numbered("VALID CONVERGING ITERATING INVALID")
_UTC = _numbered("INVALID VALID WARNING")
_ENUMERATIONS: Mapping[str, Mapping[str, int]] = {
    "solution_status": _SOLUTION,
    "position_type": _POSITION,
    "type": _POSITION,
    "ins_solution_status": _INS,
    "datum_id": _DATUM,
    "clock_status": _CLOCK,
    "utc_status": _UTC,
}
_HEXADECIMAL = frozenset(
    (
        *("extended_solution_status2", "ext_sol_stat", "gal_and_bds_mask", "gps_and_glo_mask", "extended_sol_stat"),
        *("imu_status", "imu_status_info"),
    )
)
_CODES = {"r4": "f", "r8": "d", "u1": "B", "u2": "H", "u4": "I", "i4": "i"}


@dataclass(frozen=True, eq=False)
class TextLogs:
    """Logs of a block in their binary form.

    Parameters
    ----------
    frames : Frames
        As they were, but the data have binary headers in place of those of text, and the bodies behind their end.
    names : list of str, length n
    offsets, payload_at, sizes : ndarrays of int64, shape (n,)
        Where each begins, where its body stands, and its bytes.
    """

    frames: Frames
    names: list[str]
    offsets: Int64Array
    payload_at: Int64Array
    sizes: Int64Array


def as_binary(frames: Frames) -> TextLogs | None:
    """The logs of a block that are text; None where there is none."""
    which = frames.of(scan.NOVATEL_TEXT)
    if not len(which):
        return None
    data = bytearray(frames.data.tobytes())
    end, bodies, names, places = len(data), bytearray(), list[str](), list[tuple[int, int]]()
    for at, length in zip(frames.offsets[which].tolist(), frames.lengths[which].tolist(), strict=True):
        head, _, rest = bytes(data[at : at + length]).partition(b";")
        text = rest[: -scan.TEXT_CRC_BYTES]
        name, header = _header(head.decode("ascii").split(","))
        body = _body(name, text.decode("ascii"))
        if body is None:
            name, body = name + KEPT, text
        data[at : at + HEADER.size] = header
        names.append(name)
        places.append((end + len(bodies), len(body)))
        bodies += body
    content = np.frombuffer(bytes(data) + bytes(bodies), np.uint8)
    payload_at, sizes = np.array(places, dtype=np.int64).T
    moved = Frames(content, frames.first_byte, frames.offsets, frames.lengths, frames.kinds)
    return TextLogs(moved, names, frames.offsets[which], payload_at, sizes)


def week_ms_of(frames: Frames, number: int) -> int:
    """Return the millisecond of the week in a text's header; -1 where it has none."""
    at = int(frames.offsets[number])
    head = frames.data[at : at + int(frames.lengths[number])].tobytes().partition(b";")[0]
    return int(HEADER.unpack(_header(head.decode("ascii").split(","))[1])[10])


def _header(cells: Sequence[str]) -> tuple[str, bytes]:
    """Return the name and binary header of the cells of a text's header.

    Without a time where the text states none.
    """
    is_short = cells[0].startswith("%")
    name = re.sub(r"A$", "", cells[0][1:])
    week, seconds = (cells[1:3] if is_short else cells[5:7]) if len(cells) >= (3 if is_short else 7) else ("", "")
    status = _SHORT_STATUS if is_short else _TIME_STATUS.get(cells[4] if len(cells) > 4 else "", 0)
    known = re.fullmatch(r"\d{1,4}", week) and re.fullmatch(r"\d{1,6}(\.\d{1,9})?", seconds)
    time = (int(week), round(1000.0 * float(seconds))) if known else (0, 0)
    return name, HEADER.pack(b"\xaaD\x12", HEADER.size, 0, 0, 0, 0, 0, 0, status if known else 0, *time, b"")


@cache
def _fields(name: str) -> tuple[tuple[tuple[str, str], ...], tuple[tuple[str, str], ...]]:
    """Return names and types of the head and of the group that repeats.

    Fields that are passed over are included.
    """
    head, _, group = LAYOUTS[name].partition("|")
    parts = head.split(), group.split()[1:]
    return tuple(tuple((one.partition(":")[0], one.partition(":")[2]) for one in part) for part in parts)  # type: ignore[return-value]


def _body(name: str, text: str) -> bytes | None:
    """Return the body of the binary form.

    None for a log that is not known or that its layout does not fit.
    """
    if name not in LAYOUTS:
        return None
    head, group = _fields(name)
    cells = text.split(",")
    try:
        if len(cells) < len(head):
            return None
        found = b"".join(_packed(*field, cell) for field, cell in zip(head, cells, strict=False))
        rest = cells[len(head) :]
        if not group:
            return found + bytes(len(rest))  # cells behind the layout make the body longer than it
        for start in range(0, len(rest), len(group)):
            part = rest[start : start + len(group)]
            found += b"".join(_packed(*field, cell) for field, cell in zip(group, part, strict=True))
    except (ValueError, OverflowError, struct.error):
        return None
    return found


def _packed(name: str, kind: str, cell: str) -> bytes:
    if kind[0] == "c":
        return cell.strip('"').encode("ascii")[: int(kind[1:])].ljust(int(kind[1:]), b"\0")
    return struct.pack("<" + _CODES[kind], _reader_of(name, kind)(cell))


@cache
def _reader_of(name: str, kind: str) -> Callable[[str], float]:
    """Return the function that converts a cell to a number."""
    if kind[0] == "r":
        return float
    if name in _HEXADECIMAL:
        return lambda cell: int(cell, 16)
    if name == "-":
        return lambda cell: int(cell, 16) & 0xFF  # reserved: passed over
    names = _ENUMERATIONS.get(name, {})
    return lambda cell: names[cell] if cell in names else int(cell)
