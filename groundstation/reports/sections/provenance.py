"""Chapter: where the numbers come from. Time of run, host and versions stand in manifest.json alone."""

from groundstation.chapters.parts import Facts, Note, Part, Section
from groundstation.chapters.wording import ABSENT, clean, number
from groundstation.reports.sections.saved import mapping
from groundstation.results.files import SavedFlight

LONG_LISTS = ("parameter.", "units.")  # of autopilot logs, hundreds of them
MOST_METADATA = 40


def build(saved: SavedFlight) -> Section:
    """Build the chapter."""
    flight = mapping(saved.summary, "flight")
    source = mapping(flight, "source")
    size = source.get("size_bytes")
    flight_id = clean(str(flight.get("id", "")))
    pairs = (
        ("Log", str(source.get("name") or ABSENT), f"{number(size, 0)} bytes" if size is not None else ""),
        ("SHA-256 of the log", str(source.get("sha256") or ABSENT), ""),
        ("Read by", str(source.get("reader") or ABSENT), ""),
        ("Flight id", flight_id, ""),
        ("Recording", f"{flight_id}.rrd", "open with: groundstation view"),
        ("Lossless store", f"{flight_id}.mcap", "every topic of the log"),
    )
    parts: list[Part] = [Facts("Source and files", pairs)]
    metadata = mapping(flight, "metadata")
    if metadata:
        rows = [(str(key), str(value), "") for key, value in metadata.items() if not str(key).startswith(LONG_LISTS)]
        parts.append(Facts("Metadata of the log", rows[:MOST_METADATA]))
        if len(rows[:MOST_METADATA]) < len(metadata):
            parts.append(Note("The rest of the metadata, parameters and units among it, stands in summary.json."))
    parts.append(
        Note(
            "Every number on these pages stands in summary.json or in tables/*.csv beside this file. Time of run, "
            "host, versions and configuration stand in manifest.json: equal input gives this report byte for byte."
        )
    )
    return Section("provenance", "Provenance", "Where the numbers come from and how to check them.", parts)
