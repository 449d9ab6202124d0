"""manifest.json: when, where and with what a run was made; everything that may differ between two equal runs."""

import platform
import sys
from datetime import UTC, datetime

from groundstation.base.version import __version__
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import Log
from groundstation.pipeline.one_flight.resume import versions
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult
from groundstation.results.manifest import Host, Manifest, Resume, SourceOfRun


def manifest_of(log: Log, url: str, results: FlightResults, configuration: Configuration, resume: Resume) -> Manifest:
    """Describe a run: the log, what the user set, versions, host and time, and what a later run need not do again.

    ``url`` is where the log is, if this machine has but a copy of it.
    """
    source, heading = log.source, results.answer(HeadingResult)
    return Manifest(
        groundstation=__version__,
        flight_id=results.flight_id,
        made_utc=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        source=SourceOfRun(
            url or str(log.path.absolute()), source.name, source.sha256, source.size_bytes, source.reader
        ),
        configuration=configuration.to_dict(),
        heading_settings=heading.settings if heading else {},
        host=Host(platform.platform(), platform.machine(), sys.version.split()[0]),
        versions=versions(),
        resume=resume,
    )
