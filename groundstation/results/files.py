"""Files of one flight: summary.json, manifest.json, arrays/*.parquet, tables/*.csv.

The tables are readable copies of the arrays, but for those of too many rows to read.
"""

import io
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from os import SEEK_END
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.failures import CODE, Failure, attempt, with_failures
from groundstation.base.printable import printable_json
from groundstation.base.serial import MismatchError, from_json, to_json, to_json_exactly
from groundstation.base.to_disk import sync_file
from groundstation.results.answer import Answer
from groundstation.results.arrays.typed import T
from groundstation.results.chosen import chosen_intervals
from groundstation.results.csv_table import csv_text as csv_text
from groundstation.results.document import SummaryDocument
from groundstation.results.figures import FigureData, FigureSet
from groundstation.results.file_names import ARRAYS, MANIFEST, OLD_ARRAYS, SUMMARY, TABLES
from groundstation.results.flight import FlightResults
from groundstation.results.manifest import Manifest
from groundstation.results.restore import restored
from groundstation.results.summary import summary_of

Document = TypeVar("Document")
OLD_COLUMNS: Mapping[str, Mapping[str, str]] = {  # names of an earlier version, still read
    "heading_samples": {"used": "is_used"},
    "standstill_velocity": {"in_interval": "is_in_interval"},
    "inertial_states": {"gnss_used": "is_gnss_used"},
    "magnetic_ground_epochs": {"error_deg": "heading_error_deg"},
    "magnetic_ground_curve": {"error_deg": "heading_error_deg", "sigma_deg": "heading_error_sigma_deg"},
    "reference_errors": {
        **{f"{axis}_m": f"{axis}_error_m" for axis in ("north", "east", "up")},
        **{f"{axis}_mps": f"{axis}_error_mps" for axis in ("north", "east", "up")},
        **{f"{angle}_deg": f"{angle}_error_deg" for angle in ("roll", "pitch", "heading")},
    },
    "magnetic_samples": {"magnetic_heading_deg": "uncorrected_magnetic_heading_deg"},
    "magnetic_table": {"magnetic_heading_deg": "uncorrected_magnetic_heading_deg"},
    "magnetic_curves": {
        "magnetic_heading_deg": "uncorrected_magnetic_heading_deg",
        "deviation_recommended_deg": "deviation_to_add_deg",
        "sigma_recommended_deg": "deviation_sigma_deg",
    },
}
PARQUET_MAGIC = b"PAR1"  # at both ends of a whole file
PARQUET_LEAST_BYTES = 12  # both, and the length of what describes the file


@dataclass(frozen=True)
class SavedFlight:
    """Contents of a flight folder, as the report, ``compare`` and the fleet read it.

    ``results`` are the answers as the run had them; the arrays in ``figures`` are read when they are asked for.
    ``summary`` is the JSON document.
    """

    folder: Path
    summary: Mapping[str, Any]
    manifest: Manifest
    figures: Mapping[str, FigureData]
    answer_types: Mapping[str, type[Answer]]

    @cached_property
    def results(self) -> FlightResults:
        """Return the answers, rounded as they were written.

        Their arrays are read when they are asked for.

        Raises
        ------
        UnreadableLogError
            When the summary lacks what a result needs.
        """
        results = restored(self.summary, str(self.folder / SUMMARY), self.answer_types)
        figures = FigureSet(self.figures, self.figures.__getitem__)
        return replace(results, figures=figures, chosen=chosen_intervals(self.manifest.configuration))

    def rows_of(self, kind: type[T]) -> T | None:
        """Return the typed arrays of a figure; None when they are missing, empty or incomplete.

        Incomplete means that a column is missing.

        Raises
        ------
        MissingColumnError
            When they lack a column that they must have, and nobody gathers failures.
        """
        found = self.figure(kind.figure)
        return None if found is None else attempt("arrays", found.name, kind.of, found)

    def figure(self, name: str) -> FigureData | None:
        """The figure data of that name, None when the flight has none or it is empty."""
        found = self.figures.get(name)
        return found if found is not None and len(found) else None


def mapping(document: Any, *keys: str) -> Mapping[str, Any]:
    """Return the object at a path of keys, empty when it is missing or something else."""
    for key in keys:
        document = document.get(key) if isinstance(document, Mapping) else None
    return document if isinstance(document, Mapping) else {}


def write_text(path: Path, text: str, *, is_synced: bool = True) -> None:
    """Write a text file as :func:`write_bytes` does.

    A lone surrogate (a file name that is not UTF-8) is written as its escape, which JSON reads back as it was.
    """
    write_bytes(path, _encoded(text), is_synced=is_synced)


def has_text(path: Path, text: str) -> bool:
    """Tell whether a file holds the text that :func:`write_text` would write."""
    return path.is_file() and path.read_bytes() == _encoded(text)


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", "backslashreplace")


def write_bytes(path: Path, content: bytes, *, is_synced: bool = True) -> None:
    """Write a file under a temporary name and move it into place.

    A kill never leaves half a file. With ``is_synced`` a loss of power does not either; without, the caller writes it
    through to the disk.
    """
    temporary = path.with_name(f".{path.name}.partial")
    try:
        with _named_in_errors(path):
            temporary.write_bytes(content)
            if is_synced:
                sync_file(temporary)
            temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _named_in_errors(path: Path) -> Iterator[None]:
    """Name a file in the errors of the system: a full disk does not say which file it is."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def json_text(document: Any) -> str:
    """Render JSON as it is written everywhere: NaN refused, hidden characters escaped."""
    return printable_json(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)) + "\n"


def save(folder: Path, results: FlightResults, manifest: Manifest) -> None:
    """Write a flight's answers and arrays into its folder.

    Those of an earlier run are replaced. They are not yet written through to the disk.

    Parameters
    ----------
    folder : Path
        Created when missing.
    results : FlightResults
    manifest : Manifest
        Time of run, host, versions, settings: everything that may differ between two equal runs stands here alone.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name in (SUMMARY, MANIFEST):  # written last: a folder that was cut short has none, and does not look finished
        (folder / name).unlink(missing_ok=True)
    for name in (ARRAYS, OLD_ARRAYS, TABLES):
        shutil.rmtree(folder / name, ignore_errors=True)
    for name in (ARRAYS, TABLES):
        (folder / name).mkdir()
    for figure in results.figures:
        attempt("arrays", figure.name, _save_figure, folder, figure, unless=(OSError,))
    write_text(folder / SUMMARY, json_text(summary_of(results)), is_synced=False)
    save_manifest(folder, manifest, is_synced=False)


def _save_figure(folder: Path, figure: FigureData) -> None:
    text = csv_text(figure) if figure.is_copied else ""
    _write_parquet(folder / ARRAYS / f"{figure.name}.parquet", figure)
    if text:
        path = folder / TABLES / f"{figure.name}.csv"
        with _named_in_errors(path):  # in place, like the arrays: without the summary the folder is not finished
            path.write_bytes(_encoded(text))


def put_failures(folder: Path, found: Sequence[Failure], made_again: Sequence[str] = ()) -> bool:
    """Add findings on failed parts to summary.json; tell whether it changed.

    ``made_again`` are the kinds of parts of which earlier failures no longer hold.
    """
    if not found and f'"{CODE}.' not in (folder / SUMMARY).read_text(encoding="utf-8"):
        return False
    summary = _json_object(folder / SUMMARY)
    before = load_document(folder).findings
    stale = tuple(f"{CODE}.{part}." for part in made_again)
    kept = [finding for finding in before if not (stale and finding.code.startswith(stale))]
    findings = with_failures(kept, found)
    if findings == before:
        return False
    write_text(folder / SUMMARY, json_text(summary | {"findings": to_json(findings)}))
    return True


def save_manifest(folder: Path, manifest: Manifest, *, is_synced: bool = True) -> None:
    """Write manifest.json of a flight folder."""
    write_text(folder / MANIFEST, json_text(to_json_exactly(manifest)), is_synced=is_synced)


def load_manifest(folder: Path) -> Manifest:
    """Read manifest.json of a flight folder back.

    Raises
    ------
    UnreadableLogError
        When it is missing, or not as a run leaves it.
    """
    return _document(Manifest, folder / MANIFEST, _json_object(folder / MANIFEST))


def load_document(folder: Path) -> SummaryDocument:
    """Read summary.json of a flight folder back, its answers as JSON values.

    Raises
    ------
    UnreadableLogError
        When it is missing, or not as a run leaves it.
    """
    return _document(SummaryDocument, folder / SUMMARY, _json_object(folder / SUMMARY))


def _json_object(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, TypeError, ValueError) as error:
        raise UnreadableLogError(
            str(path), type(error).__name__, "the JSON file a run leaves", "run the log again"
        ) from error


def _document(kind: type[Document], path: Path, document: Mapping[str, Any]) -> Document:
    try:
        return from_json(kind, document)
    except MismatchError as error:
        what = f"a file that cannot be used ({error})"
        raise UnreadableLogError(str(path), what, "one that this version writes", "run the log again") from error


class _Figures(Mapping[str, FigureData]):
    """Figures of a flight folder by name; each is read once, when it is first asked for."""

    def __init__(self, paths: Mapping[str, Path]) -> None:
        self._paths = paths
        self._read: dict[str, FigureData] = {}

    def __getitem__(self, name: str) -> FigureData:
        if name not in self._read:
            self._read[name] = _read_parquet(self._paths[name])
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        return name in self._paths

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)


def load(folder: Path, answer_types: Mapping[str, type[Answer]]) -> SavedFlight:
    """Read a flight folder back; its figures are read when they are asked for.

    Parameters
    ----------
    folder : Path
    answer_types : mapping of analysis name to dataclass
        Types of the ``results`` of summary.json.

    Raises
    ------
    UnreadableLogError
        When the folder has no summary.json, or one that is not a JSON object; when a file of its figures is cut. A
        figure that is broken inside raises the same when it is asked for.
    """
    summary, manifest = _json_object(folder / SUMMARY), load_manifest(folder)
    paths = sorted(path for name in (ARRAYS, OLD_ARRAYS) for path in (folder / name).glob("*.parquet"))
    for path in paths:
        _require_whole(path)
    figures = _Figures({path.stem: path for path in paths})
    return SavedFlight(folder, summary, manifest, figures, answer_types)


def _require_whole(path: Path) -> None:
    """Refuse a Parquet file that is cut, by looking at its ends alone."""
    try:
        with path.open("rb") as file:
            begin = file.read(len(PARQUET_MAGIC))
            size = file.seek(0, SEEK_END)
            file.seek(max(size - len(PARQUET_MAGIC), 0))
            end = file.read()
        found = "" if size >= PARQUET_LEAST_BYTES and begin == end == PARQUET_MAGIC else "no whole file"
    except OSError as error:
        found = type(error).__name__
    if found:
        raise UnreadableLogError(str(path), found, "a Parquet file of a run", "run the log again")


def _write_parquet(path: Path, figure: FigureData) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = {
        name: _arrow_texts(values.tolist()) if values.dtype.kind in "UO" else values
        for name, values in figure.columns.items()
    }
    digits = {name: str(figure.digits[name]) for name in figure.digits}
    table = pa.table(arrays).replace_schema_metadata({"digits": json.dumps(digits, sort_keys=True)})
    pq.write_table(table, path, compression="zstd", use_dictionary=False)  # of numbers they take time and room


def _arrow_texts(values: Sequence[Any]) -> Any:
    import pyarrow as pa

    texts = list(map(str, values))
    utf8 = {text: utf8_text(text) for text in set(texts)}  # few, each many times
    return pa.array([utf8[text] for text in texts], pa.string())


def _read_parquet(path: Path) -> FigureData:
    import pyarrow.parquet as pq

    from groundstation.base import arrow_values as arrow

    columns, names = {}, OLD_COLUMNS.get(path.stem, {})
    try:
        with pq.ParquetFile(path) as file:  # read_table would import pandas
            table = file.read(use_threads=False)
        for name in table.column_names:
            values = arrow.column(table.column(name))
            columns[names.get(name, name)] = values.astype(np.str_) if values.dtype.kind == "O" else values
        digits = json.loads((table.schema.metadata or {}).get(b"digits", b"{}"))
        return FigureData(path.stem, columns, {names.get(name, name): int(places) for name, places in digits.items()})
    except (OSError, ValueError, TypeError, AttributeError, LookupError, NotImplementedError) as error:
        raise UnreadableLogError(
            str(path), type(error).__name__, "a Parquet file of a run", "run the log again"
        ) from error


def utf8_text(text: Any) -> str:
    """Return text as Parquet takes it: a lone surrogate becomes its escape."""
    return str(text).encode("utf-8", "backslashreplace").decode("utf-8")


def parquet_bytes(table: Any) -> bytes:
    """Encode a table as Parquet.

    The same rows in the same order give the same bytes, whatever they were put together from.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    for place, one in enumerate(table.schema):
        if pa.types.is_dictionary(one.type):
            again = table.column(place).cast(pa.string()).combine_chunks().dictionary_encode()
            table = table.set_column(place, pa.field(one.name, again.type), again)
    buffer = io.BytesIO()
    pq.write_table(table.combine_chunks(), buffer, compression="zstd", write_page_checksum=True)
    return buffer.getvalue()
