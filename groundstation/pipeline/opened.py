"""An open flight: from a log or an MCAP with settings, or from the folder of a run."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from groundstation.base.clock import Clock
from groundstation.base.errors import GroundstationError, told_in_a_line
from groundstation.base.ledger import Ledger
from groundstation.pipeline.many_flights.inputs import file_in
from groundstation.pipeline.notebook import AnyPath, OpenFlight
from groundstation.pipeline.one_flight.configuration import (
    NO_REFERENCES,
    Configuration,
    References,
    load_configuration,
    sections,
)
from groundstation.pipeline.one_flight.identity import flight_id
from groundstation.pipeline.one_flight.log import Log, open_log
from groundstation.pipeline.verbs.describe import facts_of

if TYPE_CHECKING:
    from groundstation.integrity.limits import Thresholds
    from groundstation.pipeline.one_flight.convert import Converted
    from groundstation.results.files import SavedFlight
    from groundstation.results.flight import FlightResults, Source
    from groundstation.tables.table import Flight


class Conversion:
    """Log with its conversion, done once and shared by all settings it is analysed with."""

    def __init__(self, log: Log, references: References = NO_REFERENCES) -> None:
        self.log, self.references = log, references
        self._done: dict[str, tuple[Converted, Flight]] = {}  # by the thresholds of the ledger

    def read(self, thresholds: "Thresholds") -> "tuple[Converted, Flight]":
        """Convert the log to an MCAP and read its tables back, as a run does."""
        from groundstation.pipeline.one_flight.convert import convert_log
        from groundstation.pipeline.one_flight.flight import read_flight

        if thresholds.sha256 not in self._done:
            with told_in_a_line(self.log.path.name), TemporaryDirectory(prefix="groundstation-") as folder:
                mcap = Path(folder) / "flight.mcap"
                converted = convert_log(self.log, mcap, thresholds, self.references)
                self._done[thresholds.sha256] = converted, read_flight(mcap, converted)
        return self._done[thresholds.sha256]


class OpenLog(OpenFlight):
    """Flight from a log or MCAP, with settings.

    Only :meth:`save` and :meth:`recording` write anything.
    """

    def __init__(self, conversion: Conversion, configuration: Configuration) -> None:
        self.configuration = configuration
        self._conversion = conversion
        self._thresholds = configuration.thresholds

    @property
    def _converted(self) -> "Converted":
        return self._conversion.read(self._thresholds)[0]

    @property
    def source(self) -> "Source":
        return self._conversion.log.source

    @property
    def ledger(self) -> Ledger:
        return self._converted.info.ledger

    @property
    def clock(self) -> Clock:
        return self._converted.info.clock

    @property
    def info(self) -> dict[str, str]:
        return facts_of(self._conversion.log, self.flight.metadata, self.ledger)

    @cached_property
    def flight(self) -> "Flight":
        """Every topic on the corrected clock, as the estimators take it."""
        return self._conversion.read(self._thresholds)[1]

    @cached_property
    def results(self) -> "FlightResults":
        """Answers of all analyses, as frozen dataclasses."""
        from groundstation.pipeline.one_flight.analyse import analyse
        from groundstation.pipeline.one_flight.flight import given_of

        flight = self.flight
        start_utc_ns = flight.start_ns if flight.has_utc else None
        identity = flight_id(start_utc_ns, flight.metadata, self.source.sha256)
        return analyse(flight, given_of(self._conversion.log, self._converted, identity), self.configuration)

    def _logged(self) -> Mapping[str, str]:
        return self.flight.metadata

    def with_settings(self, **sections: Any) -> "OpenLog":
        document = _laid_over(self.configuration.to_dict(), sections)
        profile = self.configuration.profile
        layouts: dict[str, Any] = {"profile": Path(profile) if profile else None, "icds": self.configuration.icds}
        own = self.configuration
        changed = load_configuration(document, **layouts)
        return OpenLog(self._conversion, replace(changed, references=own.references, lessons=own.lessons))

    def save(self, out: AnyPath, *, force: bool = False, pdf: bool = False) -> "SavedRun":
        """Run the log into ``out`` as the verb ``run`` does, and open the folder.

        ``pdf`` is like its option.

        Raises
        ------
        GroundstationError
            When ``out`` is something else's, or the log cannot be run.
        """
        from groundstation.pipeline.many_flights.runs.batch import run_many

        with told_in_a_line(str(out)):
            log = self._conversion.log.path
            outcome = run_many([log], Path(out), self.configuration, jobs=1, force=force, with_pdf=pdf)[0]
            if not outcome.folder:
                raise GroundstationError(str(out), outcome.text)
            return SavedRun(Path(outcome.folder))

    def _saved(self) -> "SavedFlight":
        from groundstation.results.files import SavedFlight
        from groundstation.results.manifest import Manifest
        from groundstation.results.summary import summary_of
        from groundstation.systems import systems

        manifest = Manifest(configuration=self.configuration.to_dict())
        figures = {figure.name: figure for figure in self.results.figures}
        return SavedFlight(Path(), summary_of(self.results), manifest, figures, systems().answer_types)


class SavedRun(OpenFlight):
    """Flight folder that a run made: saved answers, and tables from the MCAP in it."""

    def __init__(self, folder: Path) -> None:
        from groundstation.results.files import load
        from groundstation.systems import systems

        self.folder = folder
        self.saved = load(folder, systems().answer_types)

    @cached_property
    def results(self) -> "FlightResults":
        """Answers of all analyses, as frozen dataclasses."""
        return self.saved.results

    @property
    def source(self) -> "Source":
        return self.results.source

    @property
    def ledger(self) -> Ledger:
        return self.results.ledger

    @property
    def clock(self) -> Clock:
        return self.results.clock

    @property
    def info(self) -> dict[str, str]:
        from groundstation.results.flight import FOUND_BY_RUN

        logged = {name: fact for name, fact in self.results.metadata.items() if name not in FOUND_BY_RUN}
        return facts_of(Log(self.folder, self.source, is_store=True), logged, self.ledger)

    @cached_property
    def flight(self) -> "Flight":
        """Every topic on the corrected clock, as the estimators take it."""
        return self._log.flight

    @cached_property
    def _log(self) -> OpenLog:
        """Return the flight opened again from the MCAP, with the settings of the run."""
        mcap = file_in(self.folder, ".mcap")
        told = self.saved.manifest.configuration
        known = {name: value for name, value in told.items() if name in sections()}
        with told_in_a_line(mcap.name):
            return OpenLog(Conversion(open_log(mcap)), load_configuration(known))

    def _logged(self) -> Mapping[str, str]:
        return self.results.metadata

    def with_settings(self, **sections: Any) -> OpenLog:
        return self._log.with_settings(**sections)

    def _saved(self) -> "SavedFlight":
        return self.saved


def _laid_over(document: Mapping[str, Any], sections: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with some sections changed: mappings key by key, lists as a whole."""
    out = {name: value for name, value in document.items() if name not in ("profile", "icds", "references")}
    for name, value in sections.items():
        known = out.get(name, {})
        out[name] = {**known, **value} if isinstance(value, Mapping) and isinstance(known, Mapping) else value
    return out
