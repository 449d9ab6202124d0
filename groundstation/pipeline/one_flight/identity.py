"""Names of flights: folder and file name, from the content of the log."""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

from groundstation.base.reading import open_to_read
from groundstation.base.timescales import utc_ns_to_stamp

_NOT_ALLOWED = re.compile(r"[^A-Za-z0-9_-]+")
MAX_PART_CHARACTERS = 60
NOTIME = "NOTIME"


def sha256_of(*paths: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal; of several as of their concatenation."""
    digest = hashlib.sha256()
    for path in paths:
        with open_to_read(path) as stream:
            hashlib.file_digest(stream, lambda: digest)
    return digest.hexdigest()


def safe_part(text: str) -> str:
    """Return text fit for a file name.

    Characters other than A-Z a-z 0-9 _ - become ``-``, runs are joined.

    Examples
    --------
    >>> safe_part("L-39 #07/../x"), safe_part("Як-130")
    ('L-39-07-x', '130')
    """
    joined = re.sub(r"-{2,}", "-", _NOT_ALLOWED.sub("-", text))
    return joined.strip("-")[:MAX_PART_CHARACTERS].strip("-")


def flight_id(
    start_utc_ns: int | None, metadata: Mapping[str, str], sha256: str, power_up: int = 0, *, add_suffix: bool = False
) -> str:
    """Return the name of a flight: ``20260504T060000Z_<aircraft>_<flight>``.

    Without absolute time it is ``NOTIME_<sha8>``.

    Parameters
    ----------
    power_up : int
        Which of several in its log, from 1; 0 where the log holds one. It stands behind the digest.
    add_suffix : bool
        Another flight has the same name: add the digest.

    Examples
    --------
    >>> flight_id(1777874400000000000, {"aircraft": "L-39 07", "flight": ""}, "ab" * 32)
    '20260504T060000Z_L-39-07'
    >>> flight_id(None, {"aircraft": "x"}, "ab" * 32), flight_id(None, {}, "ab" * 32, 2)
    ('NOTIME_abababab', 'NOTIME_abababab_2')
    """
    digest = f"{sha256[:8]}_{power_up}" if power_up else sha256[:8]
    if start_utc_ns is None:
        return f"{NOTIME}_{digest}"
    parts = [utc_ns_to_stamp(start_utc_ns), *(safe_part(metadata.get(key, "")) for key in ("aircraft", "flight"))]
    return "_".join(part for part in (*parts, digest if add_suffix else "") if part)


def plain_id(identity: str, sha256: str) -> str:
    """Return the name of a flight without the digest that keeps it apart from another.

    Examples
    --------
    >>> plain_id("20260504T060000Z_A12_abababab", "ab" * 32), plain_id("NOTIME_abababab_2", "ab" * 32)
    ('20260504T060000Z_A12', 'NOTIME_abababab_2')
    """
    plain = re.sub(rf"_{sha256[:8]}(_\d+)?$", "", identity)
    return identity if plain == NOTIME else plain
