"""Python API: a flight from a log or a flight folder, computed when first asked for."""

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation.base.errors import GroundstationError, UsageError, told_in_a_line
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK, OUT_FOLDER_MARK
from groundstation.pipeline.many_flights.runs.references import judged_by
from groundstation.pipeline.notebook import AnyPath, OpenFlight
from groundstation.pipeline.one_flight.configuration import installed_as, load_configuration
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.opened import Conversion, OpenLog, SavedRun

if TYPE_CHECKING:
    from groundstation.pipeline.fleet_frame import Fleet

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
    without: str | Sequence[str] = (),
    reference: AnyPath | Sequence[AnyPath] = (),
    installation: AnyPath | None = None,
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
    without : str or sequence of str
        Analyses to leave out.
    reference : str, Path or several of them, optional
        Files, or folders of files, of which the one of the log's time judges the answers, as ``run --reference``.
    installation : str or Path, optional
        The installations.json of earlier flights: mounting and crosswind factor of each INS.

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
    icds = tuple(str(one) for one in _several(icd))
    left_out = [without] if isinstance(without, str) else without
    references = tuple(Path(one) for one in _several(reference))
    given = {"config": config, "aircraft": aircraft, "site": site, "intervals": intervals, "thresholds": thresholds}
    given["weather"] = weather
    files: dict[str, Any] = {name: _file_or_content(value) for name, value in given.items()}
    with told_in_a_line(where.name):
        if not where.exists():
            raise UsageError(str(where), "no such file or folder")
        if where.is_dir():
            told = (layout, icds, left_out, references, installation)
            if any(told) or any(value is not None for value in given.values()):
                raise UsageError(str(where), "settings for saved results", next_step="open it, then with_settings()")
            return SavedRun(_flight_folder(where))
        configuration = load_configuration(profile=layout, icds=icds, without=left_out, **files)
        configuration = installed_as(configuration, None if installation is None else Path(installation))
        configuration = judged_by(configuration, references, is_one_log=True)
        return OpenLog(Conversion(open_log(where, layout, icds), configuration.references), configuration)


def open_fleet(out: AnyPath) -> "Fleet":
    """Return the table of a folder of flights that ``run`` made, one row a flight.

    It is a pandas DataFrame; ``fleet.flight(flight_id)`` opens one of the flights, ``fleet.attrs["units"]`` has the
    units of the columns.

    Raises
    ------
    UsageError
        When the folder has none.
    GroundstationError
        When it cannot be read.
    """
    import pandas as pd

    from groundstation.pipeline.fleet_frame import fleet_of
    from groundstation.pipeline.many_flights.fleet.statistics import FLEET_PARQUET

    table = Path(out) / FLEET_PARQUET
    if not table.is_file():
        raise UsageError(str(out), f"no {FLEET_PARQUET}", "a folder of flights that `run` made")
    with told_in_a_line(str(table)):
        try:
            return fleet_of(pd.read_parquet(table), Path(out))
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


def _flight_folder(folder: Path) -> Path:
    if not (folder / FLIGHT_FOLDER_MARK).is_file():
        is_out = (folder / OUT_FOLDER_MARK).is_file()
        hint = "open one of the flight folders in it, or all with open_fleet()" if is_out else ""
        found = "a folder of flights" if is_out else "a folder that is no flight"
        raise UsageError(str(folder), found, "a log or a flight folder that `run` made", hint)
    return folder


def _several(given: AnyPath | Sequence[AnyPath]) -> Iterable[AnyPath]:
    """Return the paths of an argument that takes one or several."""
    return [given] if isinstance(given, str | PathLike) else given


def _file_or_content(settings: Settings | None) -> Path | Mapping[str, Any] | None:
    return settings if settings is None or isinstance(settings, Mapping) else Path(settings)
