"""Reading saved results without stumbling: any figure, column or key may be missing."""

from collections.abc import Mapping
from typing import Any

from groundstation.results.files import SavedFlight
from groundstation.results.files import mapping as mapping
from groundstation.results.reasons import explained


def objects(document: Any, key: str) -> list[Mapping[str, Any]]:
    """The objects in a list, none when the list is missing."""
    found = document.get(key) if isinstance(document, Mapping) else None
    return [item for item in found if isinstance(item, Mapping)] if isinstance(found, list | tuple) else []


def heading_of(saved: SavedFlight) -> Mapping[str, Any]:
    """``results.heading``, empty when the flight has none."""
    return mapping(saved.summary, "results", "heading")


def not_assessable_reason(saved: SavedFlight, analysis: str) -> str:
    """Why an analysis could not be carried out, in plain words; empty when nothing is said about it."""
    entries = objects(saved.summary, "not_assessable")
    reason = next(
        (
            str(entry.get("reason", ""))
            for entry in entries
            if str(entry.get("analysis", "")).lower().startswith(analysis)
        ),
        "",
    )
    return explained(analysis, reason)
