"""``run --apply``: the step behind the analyses, and the MCAP of what it derived."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from groundstation.base.ledger import Ledger
from groundstation.base.records import MAX_BATCH_ROWS
from groundstation.integrity.limits import Thresholds
from groundstation.pipeline.one_flight.analyse import known_of, seen_by_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import census_of, recounted
from groundstation.results.file_names import CORRECTED
from groundstation.results.flight import FlightResults
from groundstation.systems import systems
from groundstation.systems.applied import Applied, Derived
from groundstation.tables.table import Flight

if TYPE_CHECKING:
    from groundstation.store.info import StoreInfo


def corrected_name(flight_id: str) -> str:
    """Return the name of the MCAP with what was derived, beside the flight's own."""
    return f"{flight_id}{CORRECTED}"


def apply_step(flight: Flight, results: FlightResults, configuration: Configuration) -> Applied:
    """Run the step that ``--apply`` asks for on a flight with all its answers.

    Nothing is done where nothing is asked for.
    """
    asked = configuration.apply
    step = systems().apply if asked is not None else None
    if step is None:
        return Applied(results)
    known = known_of(seen_by_analyses(flight, configuration), configuration)
    return step.run(flight, results, asked, replace(known, answers=results.answers))


def write_derived(target: Path, info: "StoreInfo", derived: Derived | None, thresholds: Thresholds) -> None:
    """Write derived records as an MCAP on the clock of the flight's own.

    Nothing is written where there are none. Log times and device times are those of the samples they come from, so that
    a viewer opens both files together.

    Parameters
    ----------
    target : Path
    info : StoreInfo
        Facts of the flight's MCAP: its clock and metadata are taken over.
    derived : Derived, optional
    thresholds : Thresholds
        Limits of the ledger.
    """
    from groundstation.store.writer import StoreWriter

    if derived is None:
        return
    batch = derived.batch
    assert batch.time_ns is not None
    # Neither name nor digest of the log: this is a log of its own, and no twin of the one it comes from.
    facts = replace(
        info,
        source_name=target.name,
        source_sha256="",
        start_ns=int(batch.time_ns[0]),
        metadata={**info.metadata, **derived.metadata},
        ledger=Ledger(),
        findings=(),
        remarks=(),
        damages=(),
    )
    census = census_of(facts, thresholds)
    with StoreWriter(target, facts) as writer:
        for start in range(0, len(batch), MAX_BATCH_ROWS):
            part = batch.take(slice(start, start + MAX_BATCH_ROWS))
            writer.write(part)
            census.add(part)
        writer.info = recounted(facts, [], census)
