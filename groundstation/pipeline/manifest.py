"""manifest.json: when, where and with what a run was made; everything that may differ between two equal runs."""

import platform
import sys
from datetime import UTC, datetime
from importlib import metadata as installed
from typing import Any

from groundstation import __version__
from groundstation.pipeline.configuration import Configuration
from groundstation.pipeline.log import Log
from groundstation.results.flight import FlightResults

PACKAGES = ("mcap", "numpy", "pandas", "numba", "scipy", "pyarrow", "rerun-sdk", "protobuf", "matplotlib", "pygeomag")


def manifest_of(log: Log, results: FlightResults, configuration: Configuration) -> dict[str, Any]:
    """Describe a run: the log, what the user set, versions, host and time."""
    return {
        "groundstation": __version__,
        "flight_id": results.flight_id,
        "made_utc": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "source": {
            "path": str(log.path),
            "name": log.source.name,
            "sha256": log.source.sha256,
            "size_bytes": log.source.size_bytes,
            "reader": log.source.reader,
        },
        "configuration": configuration.to_dict(),
        "heading_settings": dict(results.heading.settings) if results.heading else {},
        "host": {
            "platform": platform.platform(),
            "machine": platform.machine(),
            "python": sys.version.split()[0],
        },
        "versions": {name: _version(name) for name in PACKAGES},
    }


def _version(package: str) -> str:
    try:
        return installed.version(package)
    except installed.PackageNotFoundError:
        return ""
