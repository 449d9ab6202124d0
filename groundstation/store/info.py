"""Facts of a store file: its source, how it was read, its clock, its integrity ledger."""

import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import field, fields
from types import MappingProxyType
from typing import Any

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.ledger import Ledger
from groundstation.base.salvage import salvaged
from groundstation.base.serial import to_json_exactly

COPY_NAME = "groundstation_copy"  # the same record before the end of data: one flip cannot take both
FORMAT_VERSION = "1"
MAX_START_NS = 1 << 62  # first sample in the year 2116: later ones are damage
_TYPED = ("clock", "ledger", "findings")
_TEXTS = {"versions", "metadata"}  # mappings whose values are text
_CHECKSUM, _FORMAT, _DEFINITIONS = "crc32", "format", "definitions_crc32"
_MAX_INTEGER = 1 << 62
_TEXT, _COUNT, _FLAG = "text", "count", "flag"
_DAMAGE = {"kind": _TEXT, "place": _TEXT, "count": _COUNT, "what": _TEXT, "topic": _TEXT, "loses_data": _FLAG}
_REMARK = {"code": _TEXT, "text": _TEXT, "topic": _TEXT}


@dataclass(frozen=True)
class _WithFindings:
    findings: tuple[Finding, ...] = ()


def _plain(value: Any) -> Any:
    """Convert numpy scalars and mappings to plain Python, for JSON."""
    if isinstance(value, Mapping):
        return {str(key): entry for key, entry in value.items()}
    if hasattr(value, "item"):
        return value.item()
    if isinstance(value, Sequence):
        return list(value)
    raise TypeError(f"{type(value).__name__} cannot be kept in the store's metadata")


def _json(value: Any) -> str:
    text = json.dumps(value, default=_plain, ensure_ascii=False, sort_keys=True, separators=(",", ":"))
    return text.encode("utf-8", "replace").decode()  # a lone surrogate from a badly coded log cannot be written


@dataclass(frozen=True)
class StoreInfo:
    """Facts about a store file.

    Untyped mappings and lists are normalised through JSON (tuples become lists, numpy scalars plain numbers): what is
    read equals what was written.

    Parameters
    ----------
    source_name : str
        Name of the log, without folders.
    source_sha256 : str
        Hexadecimal digest of the log's bytes.
    reader : str
        Reader (and profile) that read the log.
    versions : mapping of str to str
        Program and libraries that wrote the file.
    configuration : mapping, json-able
        Settings in force.
    metadata : mapping of str to str
        ``aircraft``, ``flight``, ``start_utc`` and what else the log or the user said.
    has_utc : bool
        Whether times are UTC nanoseconds since 1970; False: nanoseconds since the log's own zero (NOTIME).
    start_ns : int, optional
        Corrected time of the first sample: flight time zero.
    clock : Clock
        How the recorder's clock was read and repaired.
    ledger : Ledger
        The integrity ledger.
    findings : tuple of Finding
        What the log gave when it was converted; kept with the ledger.
    remarks, damages : sequence, json-able
        What the reader derived or assumed, and what of the log was lost.
    segments : sequence, json-able
        Power-ups of the recorder, where the log holds several.

    Examples
    --------
    >>> StoreInfo(source_name="a.csv", metadata={"aircraft": "X1"}).metadata["aircraft"]
    'X1'
    """

    source_name: str = ""
    source_sha256: str = ""
    reader: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    configuration: Mapping[str, Any] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)
    has_utc: bool = False
    start_ns: int | None = None
    clock: Clock = field(default_factory=Clock)
    ledger: Ledger = field(default_factory=Ledger)
    findings: tuple[Finding, ...] = ()
    remarks: Sequence[Any] = ()
    damages: Sequence[Any] = ()
    segments: Sequence[Any] = ()

    def __post_init__(self) -> None:
        for entry in fields(self):
            if entry.name in _TYPED:
                continue
            value = json.loads(_json(getattr(self, entry.name)))
            if isinstance(value, dict):
                value = MappingProxyType(value)
            elif isinstance(value, list):
                value = tuple(value)
            object.__setattr__(self, entry.name, value)

    def to_strings(self, definitions_crc32: Mapping[str, int]) -> dict[str, str]:
        """Return the facts as strings for an MCAP Metadata record.

        Plain text as it is, all else as JSON; keys are sorted.

        Parameters
        ----------
        definitions_crc32 : mapping of str to int
            Checksums of the file's schema and channel records, which have none of their own.
        """
        out = {_FORMAT: FORMAT_VERSION, _DEFINITIONS: _json(definitions_crc32)}
        kept = {
            "clock": to_json_exactly(self.clock),
            "ledger": {**to_json_exactly(self.ledger), "findings": to_json_exactly(self.findings)},
        }
        for entry in fields(self):
            if entry.name == "findings" or (entry.name == "segments" and not self.segments):
                continue
            value = kept.get(entry.name, getattr(self, entry.name))
            out[entry.name] = value if isinstance(value, str) else _json(value)
        out = dict(sorted(out.items()))
        return {**out, _CHECKSUM: checksum(out)}


def checksum(strings: Mapping[str, str]) -> str:
    """Return the CRC-32 of a metadata record's strings, as eight hexadecimal digits.

    The checksum itself is left out. MCAP has no checksum for these records.
    """
    kept = {key: value for key, value in strings.items() if key != _CHECKSUM}
    return f"{zlib.crc32(_json(kept).encode()):08x}"


def is_intact(strings: Mapping[str, str]) -> bool:
    """Tell whether a metadata record's strings are as they were written."""
    return strings.get(_CHECKSUM) == checksum(strings)


def from_strings(strings: Mapping[str, str]) -> StoreInfo:
    """Read the facts in a metadata record; unreadable entries keep their defaults."""
    values: dict[str, Any] = {}
    defaults = StoreInfo()
    for entry in fields(StoreInfo):
        default = {} if entry.name in _TYPED else getattr(defaults, entry.name)
        text = strings.get(entry.name, "")
        try:
            value = text if isinstance(default, str) else json.loads(text)
        except (ValueError, RecursionError):
            continue
        if entry.name != "findings" and _fits(value, default):
            values[entry.name] = value
    for name in _TEXTS & values.keys():
        values[name] = {key: value if isinstance(value, str) else str(value) for key, value in values[name].items()}
    if "ledger" in values:
        values["findings"] = salvaged(_WithFindings, values["ledger"]).findings
        values["ledger"] = salvaged(Ledger, values["ledger"])
    if "clock" in values:
        values["clock"] = salvaged(Clock, values["clock"])
    for name, sound in (("damages", sound_damages), ("remarks", sound_remarks)):
        values[name] = sound(values.get(name))
    if abs(values.get("start_ns") or 0) > MAX_START_NS:
        values["start_ns"] = None
    try:
        return StoreInfo(**values)
    except (RecursionError, ValueError):
        return defaults


def _fits(value: Any, default: Any) -> bool:
    if isinstance(default, Mapping):
        return isinstance(value, dict)
    if isinstance(default, tuple):
        return isinstance(value, list)
    if default is None:
        return value is None or type(value) is int
    return type(value) is type(default)


def definition_checksums(strings: Mapping[str, str]) -> dict[str, int]:
    """Return the checksums of schema and channel records (``"schema 1"``, ``"channel 1"``).

    Empty when not known.
    """
    try:
        found = json.loads(strings.get(_DEFINITIONS, "{}"))
    except (ValueError, RecursionError):
        return {}
    if not isinstance(found, dict):
        return {}
    return {str(key): value for key, value in found.items() if isinstance(value, int)}


def _is_a(value: Any, kind: str) -> bool:
    if kind == _TEXT:
        return isinstance(value, str)
    if kind == _FLAG:
        return isinstance(value, bool)
    return type(value) is int and 0 <= value < _MAX_INTEGER


def _agrees(entry: Any, shape: Mapping[str, str]) -> bool:
    """Tell whether the keys that an entry has agree with a shape; all may be absent."""
    return isinstance(entry, dict) and all(_is_a(entry[key], kind) for key, kind in shape.items() if key in entry)


def sound_damages(entries: Any) -> list[Any]:
    """Return the entries that may be damage.

    Examples
    --------
    >>> sound_damages([{"kind": "cut"}, {"kind": []}, 7])
    [{'kind': 'cut'}]
    """
    return [entry for entry in _listed(entries) if _agrees(entry, _DAMAGE)]


def sound_remarks(entries: Any) -> list[Any]:
    """Return the entries that may be remarks."""
    return [entry for entry in _listed(entries) if _agrees(entry, _REMARK)]


def _listed(entries: Any) -> list[Any]:
    return list(entries) if isinstance(entries, list | tuple) else []
