"""Verb ``compare``: two flight folders against each other, from their saved results alone."""

import math
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import replace
from pathlib import Path
from typing import Any

from groundstation.base.angles import wrap_180
from groundstation.base.errors import UsageError
from groundstation.base.findings import SEVERITIES, Finding
from groundstation.base.signals import is_canonical
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.wording import is_number
from groundstation.pipeline.many_flights.inputs import COMPARISON_MARKS, COMPARISON_RECORDING, is_ours, is_session
from groundstation.pipeline.verbs.alignment import align
from groundstation.pipeline.verbs.clip import CUT_SHA256
from groundstation.results.comparison import Comparison, Delta, Event, SettingPair, Side, Value
from groundstation.results.file_names import MANIFEST
from groundstation.results.files import SavedFlight, csv_text, load, mapping, write_text
from groundstation.results.flight import NotAssessable
from groundstation.results.grouped_findings import grouped
from groundstation.systems import systems

(PAGE, TABLE), RECORDING = COMPARISON_MARKS, COMPARISON_RECORDING
IDENTITY = (  # what tells the rows of a table in the results apart
    *("name", "reference", "other", "quantity", "method", "phase"),
    *("start_h", "horizon_min", "length_min", "length_s"),
    *("algorithm", "vehicle", "receiver", "source"),
)
STATED_SIGMA = {  # where it is not named as the number with "sigma" before the unit
    "error_deg": ("standard_error_deg", "sigma_deg"),
    "parking_heading_deg": ("parking_sigma_deg",),
    "latency_s": ("sigma_s",),
    "value": ("sigma",),
}
NO_ANSWER = ("settings", "title", "unit", "limit", "reason", "figures")
OF_A_STAND = ("parking_heading_deg", "parking_ins_heading_deg", "reference_parking_heading_deg")
LONGEST_TEXT = 60
MAIN = ("status", "flight.duration_s")  # of every flight; those of an answer: Analysis.is_main


def compare(a: Path, b: Path, event: Event | None = None) -> tuple[Comparison, SavedFlight, SavedFlight]:
    """Compare two flight folders, or two sessions.

    Parameters
    ----------
    a, b : Path
    event : str, optional
        What their clocks are aligned on; see :func:`groundstation.pipeline.verbs.alignment.align`.

    Raises
    ------
    UsageError
        When a path is no flight folder, one is a session and the other a flight, or a flight does not have the event.
    UnreadableLogError
        When what a folder holds cannot be read.
    """
    if is_session(a) != is_session(b):
        session = a if is_session(a) else b
        raise UsageError(str(session), "a session of several aircraft", "a flight, like the other")
    saved_a, saved_b = _load(a), _load(b)
    one, other = _side(saved_a), _side(saved_b)
    origins = {_origin(saved) for saved in (saved_a, saved_b)}
    is_same_log = len(origins) == 1 and origins != {""}
    findings = _findings(saved_a), _findings(saved_b)
    reasons = _reasons(saved_a), _reasons(saved_b)
    comparison = Comparison(
        one,
        other,
        is_same_log,
        align(saved_a, saved_b, event, is_same_log=is_same_log),
        (
            *deltas_of(saved_a.summary, saved_b.summary, is_same_log=is_same_log),
            *_columns(saved_a, saved_b),
        ),
        _settings(saved_a, saved_b),
        _only(findings[0], findings[1]),
        _only(findings[1], findings[0]),
        tuple(entry for name, entry in reasons[0].items() if name not in reasons[1]),
        tuple(entry for name, entry in reasons[1].items() if name not in reasons[0]),
        is_session(a),
    )
    return comparison, saved_a, saved_b


def compare_to(a: Path, b: Path, folder: Path, event: Event | None = None, *, force: bool = False) -> Comparison:
    """Compare two flight folders and write the result into a folder.

    ``compare.html``, ``compare.csv`` and ``compare.rrd``.

    Raises
    ------
    UsageError
        As :func:`compare`, and when the files are there already and ``force`` is not given.
    """
    from groundstation.reports.comparison import comparison_html
    from groundstation.viewer.comparison import write_comparison

    if folder.exists() and not folder.is_dir():
        raise UsageError(str(folder), "a file", "a folder for the results")
    if is_ours(folder) and not (folder / PAGE).exists():
        raise UsageError(str(folder), "a folder of flights, or one flight", "a folder of its own", "name another -o")
    there = [path for name in (PAGE, TABLE, RECORDING) if (path := folder / name).exists()]
    if there and not force:
        raise UsageError(str(there[0]), "a file that exists", "a new folder", "-f overwrites it")
    comparison, saved_a, saved_b = compare(a, b, event)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / TABLE, csv_text(comparison.to_figure()))
    write_comparison(folder / RECORDING, comparison, saved_a, saved_b, systems())
    write_text(folder / PAGE, comparison_html(comparison, saved_a, saved_b, systems()))
    return comparison


def _load(folder: Path) -> SavedFlight:
    if not folder.is_dir() or not (folder / MANIFEST).is_file():
        found = "no such folder" if not folder.exists() else "no results"
        raise UsageError(str(folder), found, "a flight folder that `run` made")
    return load(folder, systems().answer_types)


def _side(saved: SavedFlight) -> Side:
    results = saved.results
    start_ns = results.start_utc_ns
    return Side(
        results.flight_id or saved.folder.name,
        results.metadata.get("aircraft", ""),
        results.metadata.get("flight", ""),
        results.source.name,
        results.source.sha256,
        None if start_ns is None else utc_ns_to_iso(start_ns),
        results.duration_s if math.isfinite(results.duration_s) else None,
    )


def _origin(saved: SavedFlight) -> str:
    """Return the digest of the log a flight came from; of a part, that of the whole."""
    return saved.results.metadata.get(CUT_SHA256) or saved.results.source.sha256


# ---------------------------------------------------------------------------------------------------- answers


def deltas_of(a: Mapping[str, Any], b: Mapping[str, Any], *, is_same_log: bool = True) -> tuple[Delta, ...]:
    """Return the differences of every answer that two summaries have in common.

    Texts of lesser weight only where they differ. Headings of a stand only of one log: two flights park anywhere.

    Examples
    --------
    >>> a, b = ({"results": {"heading": {"error_deg": e, "standard_error_deg": 0.03}}} for e in (179.9, -179.9))
    >>> _, delta, _ = deltas_of(a, b)
    >>> delta.name, round(delta.delta, 6), round(delta.sigma, 6), delta.is_significant
    ('heading.error_deg', 0.2, 0.042426, True)
    """
    a, b = _judged(a), _judged(b)
    answers_a, answers_b = _answers(a), _answers(b)
    is_main_of = _main_numbers(a, b)
    deltas = []
    for name, (value_a, sigma_a) in answers_a.items():
        value_b, sigma_b = answers_b.get(name, (None, None))
        if not is_same_log and name.rpartition(".")[2] in OF_A_STAND:
            continue
        is_main = is_main_of(name)
        if name not in answers_b or value_a is value_b is None:
            continue
        if not (is_number(value_a) or is_number(value_b) or is_main or value_a != value_b):
            continue
        delta = _difference(name, value_a, value_b)
        sigma = None if delta is None or sigma_a is None or sigma_b is None else round(math.hypot(sigma_a, sigma_b), 9)
        deltas.append(Delta(name, value_a, value_b, delta, sigma, is_main))
    return tuple(deltas)


def _judged(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return a summary without the answers of a reference that judges nothing."""
    results = mapping(summary, "results")
    kept = {name: one for name, one in results.items() if mapping(results, name).get("is_judge") is not False}
    return {**summary, "results": kept}


def _columns(a: SavedFlight, b: SavedFlight) -> tuple[Delta, ...]:
    """Return the differences of the columns that analyses name for it."""
    found = []
    for analysis in systems().analyses:
        sides = (analysis.values(a.results.answers), analysis.values(b.results.answers))
        for column in analysis.columns:
            if column.name not in analysis.compared or not all(column.name in side for side in sides):
                continue
            one, other = (_plain(side[column.name]) for side in sides)
            if one is None and other is None:
                continue
            name = f"{analysis.name}.{column.name}"
            meaning = column.meaning.partition(":")[0]
            title = f"{analysis.page_title or analysis.name}: {meaning}"
            found.append(Delta(name, one, other, _difference(name, one, other), None, True, title))
    return tuple(found)


def _plain(value: Any) -> Value:
    if value is None or value == "" or (isinstance(value, float) and not math.isfinite(value)):
        return None
    return value if isinstance(value, str | bool) else float(value)


def _difference(name: str, a: Value, b: Value) -> float | None:
    if not is_number(a) or not is_number(b):
        return None
    return round(float(wrap_180(b - a)) if name.endswith("_deg") else b - a, 9)


def _main_numbers(a: Mapping[str, Any], b: Mapping[str, Any]) -> Callable[[str], bool]:
    """Return what tells the main numbers of two summaries by their names."""
    every = {one.name: one for one in (*systems().analyses, *systems().session_analyses)}
    saved = {name: tuple(mapping(summary, "results", name) for summary in (a, b)) for name in every}

    def is_main(name: str) -> bool:
        first, _, path = name.partition(".")
        if first in every:
            return every[first].is_main(path, saved[first])
        return name in MAIN or (first == "completeness" and is_canonical(path))

    return is_main


def _answers(summary: Mapping[str, Any]) -> dict[str, tuple[Value, float | None]]:
    """Return answers of a summary by name, each with the sigma it states."""
    flight, completeness = mapping(summary, "flight"), mapping(summary, "completeness")
    found: dict[str, tuple[Value, float | None]] = {"status": (str(summary.get("status", "")), None)}
    found |= dict(_walk("flight", {"duration_s": flight.get("duration_s")}))
    found |= dict(_walk("completeness", completeness))
    for analysis, answer in mapping(summary, "results").items():
        found |= dict(_walk(str(analysis), answer))
    return found


def _walk(path: str, node: Any) -> Iterator[tuple[str, tuple[Value, float | None]]]:
    if isinstance(node, Mapping):
        for key, value in node.items():
            if key in NO_ANSWER:
                continue
            if isinstance(value, Mapping | list):
                yield from _walk(_pair_path(path, key) if _is_pair(value) else f"{path}.{key}", value)
            elif value is None or is_number(value) or isinstance(value, bool):
                yield f"{path}.{key}", (value, _stated_sigma(node, key))
            elif isinstance(value, str) and len(value) <= LONGEST_TEXT and not key.endswith(NO_ANSWER):
                yield f"{path}.{key}", (value, None)
    elif _is_pair(node):
        for end, value in zip(("low", "high"), node, strict=True):
            yield path.replace("{end}", end), (value, None)
    elif isinstance(node, list) and all(isinstance(row, Mapping) for row in node):
        yield f"{path}.count", (len(node), None)
        for row in node:
            identity = [_told(key, row[key]) for key in IDENTITY if row.get(key) not in (None, "")]
            if identity and "start_s" not in row:  # what happened at a time of one flight has no namesake in the other
                rest = {key: value for key, value in row.items() if key not in IDENTITY}
                yield from _walk(".".join([path, *identity]), rest)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(is_number, value))


def _pair_path(path: str, key: str) -> str:
    """Return the path of an interval's ends, with ``low`` and ``high`` before the unit."""
    stem, _, unit = key.rpartition("_")
    return f"{path}.{stem}_{{end}}_{unit}" if stem else f"{path}.{key}_{{end}}"


def _told(key: str, value: Any) -> str:
    """Return the identity of a row: names as they are, numbers with the unit of their field."""
    return f"{value:g}{key.rpartition('_')[2]}" if is_number(value) else str(value)


def _stated_sigma(node: Mapping[str, Any], key: str) -> float | None:
    """Return the sigma beside a number.

    Examples
    --------
    >>> _stated_sigma({"drift_deg_per_h": 1.0, "drift_sigma_deg_per_h": 0.2}, "drift_deg_per_h")
    0.2
    """
    parts = key.split("_")
    names = ["_".join([*parts[:place], "sigma", *parts[place:]]) for place in range(len(parts) - 1, 0, -1)]
    known = (node.get(name) for name in (*STATED_SIGMA.get(key, ()), *names))
    return next((float(sigma) for sigma in known if is_number(sigma)), None)


# ---------------------------------------------------------------------------------------------------- the rest


def _settings(a: SavedFlight, b: SavedFlight) -> tuple[SettingPair, ...]:
    """Return the settings in force, and versions, that differ."""
    both = mapping(a.summary, "results").keys() & mapping(b.summary, "results").keys()
    ours, theirs = _settings_of(a, both), _settings_of(b, both)
    names = [*ours, *(name for name in theirs if name not in ours)]
    pairs = (SettingPair(name, ours.get(name), theirs.get(name)) for name in names)
    return tuple(pair for pair in pairs if pair.a != pair.b)


def _settings_of(saved: SavedFlight, analyses: AbstractSet[str]) -> dict[str, Value]:
    """Return the settings that the user set, with those that the analyses report over them."""
    found = dict(_leaves("", saved.manifest.configuration))
    for analysis in sorted(analyses):
        found |= dict(_leaves(f"{analysis}.", mapping(saved.summary, "results", analysis, "settings")))
    versions = {"groundstation": saved.manifest.groundstation, **saved.manifest.versions}
    return found | dict(_leaves("version.", versions))


def _leaves(path: str, node: Any) -> Iterator[tuple[str, Value]]:
    items = node.items() if isinstance(node, Mapping) else enumerate(node)
    for key, value in items:
        if isinstance(value, Mapping | list):
            yield from _leaves(f"{path}{key}.", value)
        else:
            yield f"{path}{key}", value


def _findings(saved: SavedFlight) -> tuple[Finding, ...]:
    told_as_reasons = ".not_assessable"
    every = saved.results.findings
    found = [replace(one, count=None) for one in every if not one.code.endswith(told_as_reasons)]
    return grouped(sorted(found, key=lambda finding: -SEVERITIES.index(finding.severity)))


def _only(findings: tuple[Finding, ...], others: tuple[Finding, ...]) -> tuple[Finding, ...]:
    known = {(finding.severity, finding.code, finding.topic) for finding in others}
    return tuple(finding for finding in findings if (finding.severity, finding.code, finding.topic) not in known)


def _reasons(saved: SavedFlight) -> dict[str, NotAssessable]:
    return {entry.analysis: entry for entry in saved.results.not_assessable}
