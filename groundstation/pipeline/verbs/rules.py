"""``rules test``: verdicts that other limits would change, from the saved gates.

It needs no logs.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.serial import to_json
from groundstation.pipeline.many_flights.inputs import saved_flights
from groundstation.pipeline.one_flight.configuration import Configuration, load_configuration
from groundstation.results.figures import FigureData
from groundstation.results.files import SavedFlight, csv_text, load, mapping, write_text
from groundstation.results.gates import Gate
from groundstation.results.rules import Rejudged
from groundstation.systems import systems
from groundstation.systems.analysis import RejudgeAlso

OTHER_TABLES = ("aircraft", "site", "thresholds")  # they change what is measured, not how it is judged
SHIPPED = "shipped limits"


@dataclass(frozen=True)
class RulesRow:
    """One gate of one verdict before and after.

    ``gate`` is empty where no gate has another limit or state. ``needs_log`` names what else is set otherwise than in
    the run: it may change the value, which only a run shows.
    """

    flight_id: str
    aircraft: str
    subject: str
    verdict_before: str
    verdict_after: str
    gate: str = ""
    title: str = ""
    unit: str = ""
    value: float | None = None
    limit_before: str = ""
    limit_after: str = ""
    state_before: str = ""
    state_after: str = ""
    rules_before: str = ""
    rules_after: str = ""
    needs_log: str = ""


@dataclass(frozen=True)
class RulesTest:
    """Every verdict of a folder under other limits.

    ``judged`` and ``changed`` count verdicts; ``no_longer_accepted`` those that were accept, or stabilised.
    ``unread`` are flights that cannot be read, with the reason.
    """

    rules: str
    flights: int
    judged: int
    changed: int
    no_longer_accepted: int
    need_log: int
    rows: tuple[RulesRow, ...]
    unread: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        document: dict[str, Any] = to_json(self)
        return document


def rules_test(new: Path, out: Path) -> RulesTest:
    """Judge every verdict of a folder again with the settings of a file.

    The file is like that of ``run --config``.

    Raises
    ------
    UsageError
        When the folder is not one that ``run`` made.
    SettingsError
        For a settings file that cannot be used.
    """
    configuration = load_configuration(new)
    folders = saved_flights(out)
    told: list[RulesRow] = []
    unread: list[str] = []
    judged: list[tuple[Rejudged, str]] = []
    also = {one.name: one.rules.also_in(out) for one in systems().analyses if one.rules and one.rules.also_in}
    for folder in folders:
        try:
            saved = load(folder, systems().answer_types)
            found = list(_of_flight(saved, configuration, also))
        except GroundstationError as error:
            unread.append(str(error))
            continue
        judged += found
        for one, needs_log in found:
            told += _rows(saved, one, needs_log, configuration)
    changed = [one for one, _ in judged if one.is_changed]
    return RulesTest(
        rules_name(configuration),
        len(folders),
        len(judged),
        len(changed),
        sum(one.before in ("accept", "stabilised") for one in changed),
        sum(bool(needs_log) for _, needs_log in judged),
        tuple(told),
        tuple(unread),
    )


def rules_name(configuration: Configuration) -> str:
    """Return the name of the limits, and a digest of all that the file sets."""
    text = json.dumps(configuration.to_dict(), sort_keys=True, default=str)
    return f"{configuration.rules.version or 'unnamed'} ({hashlib.sha256(text.encode()).hexdigest()[:8]})"


def csv_of(found: RulesTest) -> str:
    """Return the table of every gate with another limit or state."""
    columns: dict[str, Any] = {}
    for field in fields(RulesRow):
        values = [getattr(row, field.name) for row in found.rows]
        is_value = field.name == "value"
        columns[field.name] = np.array(
            [np.nan if value is None else value for value in values], dtype=np.float64 if is_value else np.str_
        )
    return csv_text(FigureData("rules", columns, {"value": 5}))


def write_rules(found: RulesTest, path: Path) -> None:
    """Write that table."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, csv_of(found))


def _of_flight(
    saved: SavedFlight, configuration: Configuration, also: Mapping[str, RejudgeAlso]
) -> Iterator[tuple[Rejudged, str]]:
    """Return every verdict of a flight, judged again, and what only its log could tell."""
    results, unsure = saved.results, set[str]()
    for analysis in systems().analyses:
        answer = results.answers.get(analysis.name)
        if answer is None or analysis.rules is None:
            continue
        settings = configuration.settings.analyses[analysis.settings_table]
        stored = getattr(answer, "settings", {})
        missing = _not_limits(settings, stored, analysis.rules.limits)
        missing += [name for name in OTHER_TABLES if _differs(saved, configuration, name)]
        missing += [f"its {name}" for name in analysis.builds_on if name in unsure]
        for one in analysis.rules.rejudge(answer, settings):
            if missing or one.gates_before != one.gates_after:
                unsure.add(analysis.name)
            yield one, ", ".join(missing)
            more = also[analysis.name](saved.folder.name, one, settings) if analysis.name in also else ()
            for beside in more:
                yield beside, ", ".join(missing)


def _not_limits(settings: Any, stored: Mapping[str, Any], limits: frozenset[str]) -> list[str]:
    """Return settings that differ from those of the run and are no mere limits.

    Or that the run did not report.
    """
    found = dict.fromkeys(
        name.partition(".")[0] for name, value in to_json(_flat(settings)).items() if stored.get(name) != value
    )
    return [name for name in found if name not in limits]


def _flat(settings: Any) -> dict[str, Any]:
    """Return settings as an answer keeps them: ranges as two ends, without those left out."""
    out: dict[str, Any] = {}
    for name, value in asdict(settings).items():
        if isinstance(value, tuple):
            out |= dict(zip((f"{name}.low", f"{name}.high"), value, strict=True))
        elif value is not None:
            out[name] = value
    return out


def _differs(saved: SavedFlight, configuration: Configuration, table: str) -> bool:
    """Tell whether the file has a table that differs from that of the run."""
    given = configuration.tables.get(table)
    return bool(given) and dict(given or {}) != dict(mapping(saved.manifest.configuration, table))


def _rows(saved: SavedFlight, one: Rejudged, needs_log: str, new: Configuration) -> Iterator[RulesRow]:
    """Yield a row for each gate with another limit or state.

    One row without a gate where only the log can tell.
    """
    label = mapping(saved.manifest.configuration, "rules").get("version")
    whole = RulesRow(
        flight_id=saved.folder.name,
        aircraft=saved.results.metadata.get("aircraft", ""),
        subject=one.subject,
        verdict_before=one.before,
        verdict_after=one.after,
        rules_before=f"{label or SHIPPED}, groundstation {saved.manifest.groundstation}",
        rules_after=rules_name(new),
        needs_log=needs_log,
    )
    pairs = [
        (old, under)
        for old, under in zip(one.gates_before, one.gates_after, strict=True)
        if (old.limit, old.state, old.required) != (under.limit, under.state, under.required)
    ]
    for old, under in pairs:
        yield replace(
            whole,
            gate=old.name,
            title=old.title,
            unit=old.unit,
            value=old.value,
            limit_before=_limit(old),
            limit_after=_limit(under),
            state_before=old.state,
            state_after=under.state,
        )
    if not pairs and (needs_log or one.is_changed):
        yield whole


def _limit(gate: Gate) -> str:
    ends = gate.limit if isinstance(gate.limit, tuple) else (gate.limit,)
    sign = {"at_most": "<= ", "at_least": ">= "}.get(gate.sense, "")
    return sign + " to ".join(f"{end:.6g}" for end in ends) + ("" if gate.required else " (informs)")
