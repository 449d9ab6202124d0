"""Contents of a recording or layout file: who wrote it, timelines, entities, tabs."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC as UTC_ZONE
from datetime import datetime
from pathlib import Path
from typing import Any
from uuid import UUID

import numpy as np
import pyarrow as pa
from rerun.chunk import Chunk, RrdReader

from groundstation.base.dataclasses import dataclass
from groundstation.base.installed import installed_version
from groundstation.viewer.recorder import UTC

MAGIC = b"RRF2"  # the file's first bytes; behind them a byte each of major, minor and patch version
VIEWPORT, VIEWS, PROPERTIES = "/viewport", "/view/", "/__properties"
NS_PER_S = 1e9


def rerun_version() -> str:
    """Return the version of the Rerun that is installed here."""
    return installed_version("rerun-sdk")


def version_in(head: bytes) -> str:
    """Return the version of the Rerun that wrote a file, from its first bytes.

    Examples
    --------
    >>> version_in(b"RRF2" + bytes([0, 41, 0, 0]))
    '0.41.0'
    """
    return ".".join(str(part) for part in head[len(MAGIC) : len(MAGIC) + 3])


def facts_of_file(path: Path) -> dict[str, str]:
    """Return what a sound file of Rerun holds, as text by name."""
    with path.open("rb") as file:
        version = version_in(file.read(len(MAGIC) + 4))
    reader = RrdReader(path)
    recordings, layouts = reader.recordings(), reader.blueprints()
    size = path.stat().st_size
    facts = {"file": path.name, "size": f"{size} bytes ({size / 1e6:.2f} MB)"}
    facts["format"] = f"Rerun {'recording' if recordings else 'layout'}"
    facts["written by"] = f"Rerun {version}; open it with `groundstation view` or a Rerun viewer of this version"
    for store in [*recordings, *layouts][:1]:
        facts["application"] = store.application_id
    for store in recordings[:1]:
        facts["recording"] = store.recording_id
        facts |= _facts_of(list(reader.stream(store=store)))
    if layouts:
        facts["tabs"] = ", ".join(tab.name for tab in layout_of(path)) or "none"
    return facts


def _facts_of(chunks: Iterable[Chunk]) -> dict[str, str]:
    """Return timelines with their spans, and counts of entities by first part of the path."""
    spans: dict[str, list[Any]] = {}
    entities: set[str] = set()
    for chunk in chunks:
        if chunk.entity_path.startswith(PROPERTIES):
            continue
        entities.add(chunk.entity_path)
        for name in () if chunk.is_static else chunk.timeline_names:
            times = np.asarray(chunk.to_record_batch().column(name).cast(pa.int64()))
            if len(times):
                spans.setdefault(name, []).extend((int(times.min()), int(times.max())))
    told = [f"{name} {_told(name, min(ends))} to {_told(name, max(ends))}" for name, ends in sorted(spans.items())]
    first = Counter(path.split("/")[1] for path in entities)
    named = ", ".join(f"{name} {count}" for name, count in sorted(first.items()))
    return {"timelines": "; ".join(told) or "none", "entities": f"{len(entities)} ({named})"}


def _told(timeline: str, value: int) -> str:
    """Return a place on a timeline as text: UTC, flight seconds, or the number of a flight."""
    if timeline == UTC:
        return datetime.fromtimestamp(value // 10**9, UTC_ZONE).strftime("%Y-%m-%dT%H:%M:%SZ")
    return str(value) if timeline.endswith("number") else f"{value / NS_PER_S:.1f} s"


@dataclass(frozen=True)
class ShownTab:
    """Tab of a layout: its name, and the entity paths of each of its views by the view's name."""

    name: str
    views: tuple[tuple[str, tuple[str, ...]], ...]


def layout_of(path: Path) -> tuple[ShownTab, ...]:
    """Return the tabs of the layout in a file, in their order; none without a layout."""
    reader = RrdReader(path)
    return tuple(tab for store in reader.blueprints()[:1] for tab in _tabs(_latest(reader.stream(store=store))))


def _tabs(rows: Mapping[str, dict[str, Any]]) -> Iterator[ShownTab]:
    root = f"/container/{_uuid(rows.get(VIEWPORT, {}).get('ViewportBlueprint:root_container'))}"
    for place in rows.get(root, {}).get("ContainerBlueprint:contents") or []:
        own = rows.get(_path(place), {})
        yield ShownTab(_name(own) or "no name", tuple(_views(rows, _path(place))))


def _views(rows: Mapping[str, dict[str, Any]], path: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the views of a container, or a view itself, with the entity paths that it shows."""
    own = rows.get(path, {})
    if path.startswith(VIEWS):
        origin = (own.get("ViewBlueprint:space_origin") or ["/"])[0]
        shown = rows.get(f"{path}/ViewContents", {}).get("ViewContents:query") or [f"{origin}/**"]
        yield _name(own), tuple(one.removeprefix("+ ").replace("$origin", origin) for one in shown)
    for place in own.get("ContainerBlueprint:contents") or []:
        yield from _views(rows, _path(place))


def _path(place: str) -> str:
    """Return the path of a part of a layout; only the viewer saves it with a slash in front."""
    return "/" + place.lstrip("/")


def _latest(chunks: Iterable[Chunk]) -> Mapping[str, dict[str, Any]]:
    """Return the last value of each component of a layout, by entity."""
    rows: dict[str, dict[str, Any]] = {}
    for chunk in chunks:
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            values = [value for value in batch.column(name).to_pylist() if value is not None]
            if ":" in name and values:
                rows.setdefault(chunk.entity_path, {})[name] = values[-1]
    return rows


def _name(row: Mapping[str, Any]) -> str:
    found = row.get("ContainerBlueprint:display_name") or row.get("ViewBlueprint:display_name") or [""]
    return str(found[0])


def _uuid(found: Any) -> str:
    """Return an id as entity paths have it."""
    return "" if not found else str(UUID(bytes=bytes(found[0])))
