"""``export --figure``: the data of figures as CSV, with units in the column names."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from groundstation.base.errors import UsageError, told_in_a_line
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.verbs.export import require_place, require_suffix, saved_flight
from groundstation.results.figures import FigureData, numbers
from groundstation.results.file_names import ARRAYS, TABLES
from groundstation.results.files import csv_text, write_text
from groundstation.results.flight import UTC_OF


def export_figures(folder: Path, target: Path, names: Sequence[str] = (), *, force: bool = False) -> Outcome:
    """Write the data of figures of a flight as CSV.

    One into the file ``target`` (.csv), several or all into that folder.

    Parameters
    ----------
    folder : Path
        A flight folder: figures are of answers, which a log has not.
    names : sequence of str
        Figures wanted, as their files in tables/ are named; none: all.

    Raises
    ------
    UsageError
        When there is no such folder or figure, or a file is there already and ``force`` is not given.
    """
    if not folder.is_dir():
        raise UsageError(str(folder), "no folder", "a flight folder that `run` made: only it has figures")
    saved = saved_flight(folder)
    for name in names:
        if name not in saved.figures:
            raise UsageError(f"figure {name}", f"not in {folder.name}", f"one of {', '.join(saved.figures)}")
    wanted = tuple(dict.fromkeys(names)) or tuple(saved.figures)
    files = {name: target / f"{name}.csv" for name in wanted}
    if len(wanted) == 1 and names:
        require_suffix(target, (".csv",))
        files = {wanted[0]: target}
    elif target.is_file():
        raise UsageError(str(target), "a file", f"a folder for {len(wanted)} figures")
    for file in files.values():
        _refuse_saved(file.parent)
        require_place(folder, file, force)
    with told_in_a_line(str(target)):
        for name, file in files.items():
            file.parent.mkdir(parents=True, exist_ok=True)
            write_text(file, csv_text(_with_utc(saved.figures[name], saved.results.start_utc_ns)))
    rows = ", ".join(f"{name} ({len(saved.figures[name])})" for name in wanted)
    return Outcome(str(folder), "done", f"-> {target}: {rows}", folder=str(target))


def _refuse_saved(place: Path) -> None:
    """Refuse the tables of a run as a target.

    summary.json and later runs rely on them as they were written.
    """
    place = place.resolve()
    if place.name in (TABLES, ARRAYS) and (place.parent / FLIGHT_FOLDER_MARK).is_file():
        raise UsageError(str(place), "a folder of the run's own results", "another one: -f does not overwrite results")


def _with_utc(figure: FigureData, start_utc_ns: int | None) -> FigureData:
    """Return the figure with UTC before its columns of flight seconds, empty if unknown."""
    if start_utc_ns is None:
        return figure
    told = {UTC_OF[name]: _utc(numbers(figure, name), start_utc_ns) for name in UTC_OF if name in figure.columns}
    return FigureData(figure.name, {**told, **figure.columns}, figure.digits)


def _utc(flight_s: np.ndarray, start_utc_ns: int) -> np.ndarray:
    known = np.isfinite(flight_s)
    at_ns = start_utc_ns + np.rint(np.where(known, flight_s, 0.0) * NS_PER_S).astype(np.int64)
    return np.array([utc_ns_to_iso(int(ns)) if is_known else "" for ns, is_known in zip(at_ns, known, strict=True)])
