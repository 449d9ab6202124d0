"""Python API: a flight from a log or a flight folder, computed when first asked for."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from groundstation.base.clock import Clock
from groundstation.base.errors import GroundstationError, UsageError, told_in_a_line
from groundstation.base.ledger import Ledger
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK, OUT_FOLDER_MARK, file_in
from groundstation.pipeline.notebook import AnyPath, OpenFlight
from groundstation.pipeline.one_flight.configuration import Configuration, load_configuration, sections
from groundstation.pipeline.one_flight.identity import flight_id
from groundstation.pipeline.one_flight.log import Log, open_log
from groundstation.pipeline.verbs.describe import facts_of

if TYPE_CHECKING:
    import pandas as pd

    from groundstation.integrity.limits import Thresholds
    from groundstation.pipeline.one_flight.convert import Converted
    from groundstation.results.files import SavedFlight
    from groundstation.results.flight import FlightResults, Source
    from groundstation.tables.table import Flight

Settings = AnyPath | Mapping[str, Any]


def open_flight(
    path: AnyPath,
    *,
    config: Settings | None = None,
    aircraft: Settings | None = None,
    site: Settings | None = None,
    intervals: Settings | None = None,
    profile: AnyPath | None = None,
    icd: AnyPath | Sequence[AnyPath] = (),
    thresholds: Settings | None = None,
    weather: Settings | None = None,
    without: Sequence[str] = (),
) -> "OpenFlight":
    """Open a flight: a recorded log, an MCAP that groundstation wrote, or a flight folder.

    Parameters
    ----------
    path : str or Path
    config, aircraft, site, intervals, thresholds : str, Path or mapping, optional
        Settings as of the verb ``run``: a TOML file, or its content as a mapping. Not for a flight folder.
    weather : str, Path or mapping, optional
        METAR lines: a text file, or a mapping with a list of them under ``weather``.
    profile : str or Path, optional
        Layout of a log that no reader knows.
    icd : str, Path or several of them, optional
        What the words of a recording's buses mean: files, or names of shipped ICDs.
    without : sequence of str
        Analyses to leave out.

    Returns
    -------
    OpenFlight
        Nothing is computed yet, but the format is known and the settings are checked.

    Raises
    ------
    GroundstationError
        When there is nothing to open, no reader claims it, or a setting is wrong.
    """
    where, layout = Path(path), None if profile is None else Path(profile)
    icds = tuple(str(one) for one in ([icd] if isinstance(icd, str | PathLike) else icd))
    given = {"config": config, "aircraft": aircraft, "site": site, "intervals": intervals, "thresholds": thresholds}
    given["weather"] = weather
    files: dict[str, Any] = {name: _file_or_content(value) for name, value in given.items()}
    with told_in_a_line(where.name):
        if not where.exists():
            raise UsageError(str(where), "no such file or folder")
        if where.is_dir():
            if layout or icds or without or any(value is not None for value in given.values()):
                raise UsageError(str(where), "settings for saved results", next_step="open it, then with_settings()")
            return SavedRun(_flight_folder(where))
        configuration = load_configuration(profile=layout, icds=icds, without=without, **files)
        return OpenLog(Conversion(open_log(where, layout, icds)), configuration)


def open_fleet(out: AnyPath) -> "pd.DataFrame":
    """Return the table of a folder of flights that ``run`` made, one row a flight.

    Raises
    ------
    UsageError
        When the folder has none.
    GroundstationError
        When it cannot be read.
    """
    import pandas as pd

    from groundstation.pipeline.many_flights.fleet.statistics import FLEET_PARQUET

    table = Path(out) / FLEET_PARQUET
    if not table.is_file():
        raise UsageError(str(out), f"no {FLEET_PARQUET}", "a folder of flights that `run` made")
    with told_in_a_line(str(table)):
        try:
            return pd.read_parquet(table)
        except ValueError as error:
            raise GroundstationError(str(table), f"unreadable ({error})", next_step="run the logs again") from error


def simulate(scenario: str, folder: AnyPath, *, seed: int | None = None) -> Path:
    """Simulate a flight with known truth into ``<folder>/<scenario>.csv``; return that path.

    A file that is there is overwritten.

    Raises
    ------
    GroundstationError
        When there is no such scenario.
    """
    from groundstation.pipeline.verbs.synthesis import simulate_to

    with told_in_a_line(str(folder)):
        return simulate_to(scenario, Path(folder), seed=seed, force=True)[0]


class Conversion:
    """Log with its conversion, done once and shared by all settings it is analysed with."""

    def __init__(self, log: Log) -> None:
        self.log = log
        self._done: dict[str, tuple[Converted, Flight]] = {}  # by the thresholds of the ledger

    def read(self, thresholds: "Thresholds") -> "tuple[Converted, Flight]":
        """Convert the log to an MCAP and read its tables back, as a run does."""
        from groundstation.pipeline.one_flight.convert import convert_log
        from groundstation.pipeline.one_flight.flight import read_flight

        if thresholds.sha256 not in self._done:
            with told_in_a_line(self.log.path.name), TemporaryDirectory(prefix="groundstation-") as folder:
                mcap = Path(folder) / "flight.mcap"
                converted = convert_log(self.log, mcap, thresholds)
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
        return self._conversion.read(self._thresholds)[1]

    @cached_property
    def results(self) -> "FlightResults":
        from groundstation.pipeline.one_flight.analyse import analyse
        from groundstation.pipeline.one_flight.flight import given_of

        flight = self.flight
        start_utc_ns = flight.start_ns if flight.has_utc else None
        identity = flight_id(start_utc_ns, flight.metadata, self.source.sha256)
        return analyse(flight, given_of(self._conversion.log, self._converted, identity), self.configuration)

    def with_settings(self, **sections: Any) -> "OpenLog":
        document = _laid_over(self.configuration.to_dict(), sections)
        profile = self.configuration.profile
        layouts: dict[str, Any] = {"profile": Path(profile) if profile else None, "icds": self.configuration.icds}
        return OpenLog(self._conversion, load_configuration(document, **layouts))

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
        return self._log.flight

    @cached_property
    def _log(self) -> OpenLog:
        """Return the flight opened again from the MCAP, with the settings of the run."""
        mcap = file_in(self.folder, ".mcap")
        told = self.saved.manifest.configuration
        known = {name: value for name, value in told.items() if name in sections()}
        with told_in_a_line(mcap.name):
            return OpenLog(Conversion(open_log(mcap)), load_configuration(known))

    def with_settings(self, **sections: Any) -> OpenLog:
        return self._log.with_settings(**sections)

    def _saved(self) -> "SavedFlight":
        return self.saved


def _flight_folder(folder: Path) -> Path:
    if not (folder / FLIGHT_FOLDER_MARK).is_file():
        is_out = (folder / OUT_FOLDER_MARK).is_file()
        hint = "open one of the flight folders in it, or all with open_fleet()" if is_out else ""
        found = "a folder of flights" if is_out else "a folder that is no flight"
        raise UsageError(str(folder), found, "a log or a flight folder that `run` made", hint)
    return folder


def _file_or_content(settings: Settings | None) -> Path | Mapping[str, Any] | None:
    return settings if settings is None or isinstance(settings, Mapping) else Path(settings)


def _laid_over(document: Mapping[str, Any], sections: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with some sections changed: mappings key by key, lists as a whole."""
    out = {name: value for name, value in document.items() if name not in ("profile", "icds")}
    for name, value in sections.items():
        known = out.get(name, {})
        out[name] = {**known, **value} if isinstance(value, Mapping) and isinstance(known, Mapping) else value
    return out
