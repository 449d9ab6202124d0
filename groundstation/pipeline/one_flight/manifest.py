"""manifest.json: when, where and with what a run was made.

Everything that may differ between two equal runs.
"""

import platform
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from groundstation.base.version import __version__
from groundstation.pipeline.one_flight.resume import versions
from groundstation.results.flight import FlightResults
from groundstation.results.manifest import Host, Manifest, PartOfRun, PowerUpOfRun, Resume, SourceOfRun
from groundstation.results.roles import HeadingByTrack


def manifest_of(
    results: FlightResults,
    configuration: Mapping[str, Any],
    *,
    path: str = "",
    resume: Resume | None = None,
    power_up: PowerUpOfRun | None = None,
    parts: Sequence[PartOfRun] = (),
) -> Manifest:
    """Describe a run of a flight, a session or a plan.

    Source, settings, versions, host and time.

    Parameters
    ----------
    results : FlightResults
    configuration : mapping
        What the user set, as TOML has it.
    path : str
        Where the source is, or its URL.
    resume : Resume, optional
        What a later run need not do again.
    power_up : PowerUpOfRun, optional
        Which of several in the log.
    parts : sequence of PartOfRun
        The consecutive logs of the flight.
    """
    source, heading = results.source, results.answer_meeting(HeadingByTrack)
    return Manifest(
        groundstation=__version__,
        flight_id=results.flight_id,
        made_utc=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        source=SourceOfRun(path, source.name, source.sha256, source.size_bytes, source.reader),
        configuration=dict(configuration),
        heading_settings=dict(heading.settings) if heading else {},
        host=Host(platform.platform(), platform.machine(), sys.version.split()[0]),
        versions=versions(),
        resume=resume,
        power_up=power_up,
        parts=tuple(parts),
    )
