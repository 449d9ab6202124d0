"""Deviation that ``run --apply`` asks for: that of another flight, or the flight's own."""

import hashlib
import json
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.results.file_names import SUMMARY
from groundstation.systems.applied import Asked
from groundstation.systems.magnetic.answer import DEVIATION_CSV
from groundstation.systems.magnetic.deviation_answer import (
    Deviation,
    deviation_from_csv,
    deviation_from_summary,
)

OWN = "own"
MOST_BYTES = 64 << 20  # a summary of a long log with many damaged spans has some
EXPECTED = f"{OWN}, a flight folder, its {SUMMARY} or a {DEVIATION_CSV}"


@dataclass(frozen=True)
class Apply(Asked):
    """Value of ``--apply`` as plain values, so that it travels to worker processes.

    ``deviation`` is None where it is to be the flight's own; ``sha256`` is of the file that another's was read from.
    """

    deviation: Deviation | None = None
    sha256: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for the manifest: whose it is."""
        if self.deviation is None:
            return {"from": OWN}
        return {"from": self.deviation.flight_id, "sha256": self.sha256}


def asked_for(text: str) -> Apply:
    """Return the deviation that the text of ``--apply`` asks for.

    Raises
    ------
    UsageError
        When it names nothing that holds a deviation.
    """
    if text == OWN:
        return Apply()
    path = Path(text)
    file = path / SUMMARY if path.is_dir() else path
    content = _content(file, text)
    if file.suffix.lower() == ".json":
        found = deviation_from_summary(_document(content, file), str(file))
    elif file.suffix.lower() == ".csv":
        found = deviation_from_csv(_text(content, file), str(file))
    else:
        raise UsageError(text, "a file of another kind", EXPECTED)
    return Apply(found, hashlib.sha256(content).hexdigest())


def _content(file: Path, text: str) -> bytes:
    if not file.is_file():
        found = f"a folder without {SUMMARY}" if Path(text).is_dir() else "no such file or folder"
        raise UsageError(text, found, EXPECTED)
    try:
        if file.stat().st_size > MOST_BYTES:
            raise UsageError(str(file), f"a file of more than {MOST_BYTES >> 20} MB", EXPECTED)
        return file.read_bytes()
    except OSError as error:
        raise UsageError(str(file), error.strerror or "cannot be read", EXPECTED) from error


def _text(content: bytes, file: Path) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise UsageError(str(file), "text that is not UTF-8", EXPECTED) from error


def _document(content: bytes, file: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(_text(content, file)))
    except (TypeError, ValueError, RecursionError) as error:
        raise UsageError(str(file), "no JSON object", EXPECTED) from error
