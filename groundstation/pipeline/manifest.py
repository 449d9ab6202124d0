"""manifest.json: when, where and with what a run was made; everything that may differ between two equal runs."""

import platform
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from groundstation import __version__
from groundstation.pipeline.configuration import Configuration
from groundstation.pipeline.log import Log
from groundstation.pipeline.resume import versions
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult


def manifest_of(
    log: Log, url: str, results: FlightResults, configuration: Configuration, resume: Mapping[str, Any]
) -> dict[str, Any]:
    """Describe a run: the log, what the user set, versions, host and time, and what a later run need not do again.

    ``url`` is where the log is, if this machine has but a copy of it.
    """
    heading = results.answer(HeadingResult)
    return {
        "groundstation": __version__,
        "flight_id": results.flight_id,
        "made_utc": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "source": {
            "path": url or str(log.path.absolute()),
            "name": log.source.name,
            "sha256": log.source.sha256,
            "size_bytes": log.source.size_bytes,
            "reader": log.source.reader,
        },
        "configuration": configuration.to_dict(),
        "heading_settings": dict(heading.settings) if heading else {},
        "host": {
            "platform": platform.platform(),
            "machine": platform.machine(),
            "python": sys.version.split()[0],
        },
        "versions": dict(versions()),
        "resume": dict(resume),
    }
