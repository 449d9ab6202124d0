"""Thresholds of the integrity ledger: one versioned TOML file, shipped with the package.

The user replaces it in whole or in part.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, field, replace
from functools import cache, cached_property
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.ledger import ThresholdsUsed
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.signals import TOPICS, field_of, kind_of
from groundstation.base.toml_settings import required_number, settings_from, trusted
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock_references import RelationSettings
from groundstation.integrity.clock_steps import ClockSettings
from groundstation.integrity.counting import CountingSettings

VERSION = 1
SHIPPED = "default"
_FILES = ShippedToml("groundstation.integrity", "thresholds", "thresholds")
Range = tuple[float, float]


@dataclass(frozen=True)
class GapLimits:
    """Limits of a gap: longer than ``periods`` nominal periods and than ``min_s`` seconds.

    A topic breaks off when it ends ``end_s`` seconds and ``end_share`` of the log before the others.
    """

    periods: float = required_number(1.0)
    min_s: float = required_number(0.0)
    end_s: float = required_number(0.0)
    end_share: float = required_number(0.0, 1.0)

    @property
    def min_ns(self) -> int:
        """Nanoseconds that a gap lasts at least."""
        return round(self.min_s * NS_PER_S)


@dataclass(frozen=True)
class RhythmLimits:
    """Criteria for a nominal rate of a topic; the file explains each number."""

    sporadic_topics: tuple[str, ...]
    fewest_steps: int = required_number(1)
    uneven: float = required_number(1.0)
    unexplained: float = required_number(0.0, 1.0)
    burst_coverage: float = required_number(0.0, 1.0)
    burst_rows: int = required_number(0)
    burst_s: float = required_number(0.0)


@dataclass(frozen=True)
class DuplicateLimits:
    """Limits beyond which records that repeat the time of the one before are a warning."""

    fewest: int = required_number(1)
    share: float = required_number(0.0, 1.0)
    standing_share: float = required_number(0.0, 1.0)


@dataclass(frozen=True)
class SequenceLimits:
    """Fields that count records, and criteria for believing them."""

    fields: tuple[str, ...]
    loss_counters: tuple[str, ...]
    fewest_steps: int = required_number(1)
    unit_share: float = required_number(0.0, 1.0)
    longest_jump: int = required_number(1)


@dataclass(frozen=True)
class StuckLimits:
    """Limits beyond which a value that does not change is stuck; the file explains each one."""

    min_s: float = required_number(0.0)
    min_samples: int = required_number(3)
    position_m: float = required_number(0.0)
    velocity_mps: float = required_number(0.0)
    heading_deg: float = required_number(0.0, 180.0)
    moving_mps: float = required_number(0.0)
    times_usual: float = required_number(1.0)
    noise_times_usual: float = required_number(1.0)
    times_resolution: float = required_number(0.0)


@dataclass(frozen=True)
class FindingLimits:
    """Limits beyond which a finding is a warning."""

    missing_times_share: float = required_number(0.0, 1.0)


@dataclass(frozen=True)
class Thresholds:
    """Every limit of the ledger.

    Parameters
    ----------
    version : int
        Version of the layout of the file.
    name : str
        Name of the limits; ``"default"`` are those that are shipped.
    ranges : mapping of topic kind to field to (low, high)
        Physical ranges; those of ``base.signals`` but for what the file states.
    """

    version: int
    name: str
    gaps: GapLimits
    rhythm: RhythmLimits
    duplicates: DuplicateLimits
    sequence: SequenceLimits
    stuck: StuckLimits
    clock: ClockSettings
    counting_clock: CountingSettings
    clock_relation: RelationSettings
    findings: FindingLimits
    ranges: Mapping[str, Mapping[str, Range]] = field(default_factory=dict)

    @cached_property
    def sha256(self) -> str:
        """Digest of the values.

        Equal limits have equal digests, whatever the file's comments and name.
        """
        values = {key: value for key, value in asdict(self).items() if key != "name"}
        return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()

    def range_of(self, topic: str, name: str) -> Range | None:
        """Return the physical range of a field, infinite where it has no end.

        It is None for a field that is not known.
        """
        known = field_of(topic, name)
        if known is None:
            return None
        return self.ranges.get(kind_of(topic), {}).get(name, (known.low, known.high))

    def used(self) -> ThresholdsUsed:
        """Identify these thresholds: name, version and digest."""
        return ThresholdsUsed(name=self.name, version=self.version, sha256=self.sha256)


@cache
def shipped() -> Thresholds:
    """The shipped thresholds."""
    stated = dict(_FILES.read(SHIPPED).table)
    ranges = _ranges(stated.pop("ranges", {}), SHIPPED, "ranges")
    return replace(trusted(Thresholds, stated), ranges=ranges)


def thresholds_from(table: Mapping[str, Any], where: str = "thresholds", key: str = "") -> Thresholds:
    """Read the user's thresholds; the shipped ones stand in for what the table leaves out.

    Parameters
    ----------
    table : mapping
        As TOML gives it; empty for the shipped thresholds. It must state ``version``.
    where, key : str
        File and dotted place of the table in it, for errors.

    Raises
    ------
    SettingsError
        For another version, an unknown key, a value of the wrong kind or out of its range.

    Examples
    --------
    >>> thresholds_from({"version": 1, "gaps": {"periods": 5.0}}).gaps
    GapLimits(periods=5.0, min_s=0.2, end_s=10.0, end_share=0.05)
    """
    if not table:
        return shipped()
    place = f"{where}, key {key}.version" if key else f"{where}, key version"
    version = table.get("version")
    if isinstance(version, bool) or version != VERSION:
        raise SettingsError(place, "nothing" if version is None else repr(version), f"version = {VERSION}")
    base = _FILES.read(SHIPPED).table
    return _thresholds(_merged(base, {"name": "user", **table}), where, key)


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Lay one table over another, table by table."""
    out = dict(base)
    for key, value in over.items():
        below = out.get(key)
        out[key] = _merged(below, value) if isinstance(below, Mapping) and isinstance(value, Mapping) else value
    return out


def _thresholds(table: Mapping[str, Any], where: str, key: str) -> Thresholds:
    stated = dict(table)
    ranges = _ranges(stated.pop("ranges", {}), where, f"{key}.ranges" if key else "ranges")
    return replace(settings_from(Thresholds, stated, where, key), ranges=ranges)


def _ranges(table: Any, where: str, key: str) -> dict[str, dict[str, Range]]:
    """The physical ranges of a file, checked."""
    if not isinstance(table, Mapping):
        raise SettingsError(f"{where}, key {key}", repr(table), "a table")
    ranges = _ranges_of_signals()
    for kind, fields in table.items():
        if kind not in TOPICS or not isinstance(fields, Mapping):
            raise SettingsError(f"{where}, key {key}.{kind}", "a key that nothing reads", f"one of {', '.join(TOPICS)}")
        known = [entry.name for entry in TOPICS[kind] if entry.kind == "double"]
        for name, ends in fields.items():
            place = f"{where}, key {key}.{kind}.{name}"
            if name not in known:
                raise SettingsError(place, "a key that nothing reads", f"one of {', '.join(known)}")
            ranges.setdefault(kind, {})[name] = _range(ends, place)
    return ranges


def _ranges_of_signals() -> dict[str, dict[str, Range]]:
    ranges: dict[str, dict[str, Range]] = {}
    for kind, fields in TOPICS.items():
        for one in fields:
            if one.kind == "double" and not (math.isinf(one.low) and math.isinf(one.high)):
                ranges.setdefault(kind, {})[one.name] = one.low, one.high
    return ranges


def _range(ends: Any, place: str) -> Range:
    is_pair = isinstance(ends, list) and len(ends) == 2
    if not is_pair or not all(isinstance(end, int | float) and not isinstance(end, bool) for end in ends):
        raise SettingsError(place, repr(ends), "[lowest, highest]")
    if not ends[0] < ends[1]:  # NaN too
        raise SettingsError(place, repr(ends), "[lowest, highest], the first less than the second")
    return float(ends[0]), float(ends[1])
