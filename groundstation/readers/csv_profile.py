"""Tables of any layout, described by a profile (TOML): one of the shipped ones, or the user's.

``record_index`` is the line number in the file (from 1). Columns that the profile does not name are kept under the
profile's raw topic.
"""

from collections.abc import Container, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Item, LogHeader, Remark
from groundstation.base.slips import slips
from groundstation.base.source_units import PREFIX, units_entry
from groundstation.readers.dialect import (
    DELIMITERS,
    Dialect,
    Line,
    detect_encoding,
    head_lines,
    normal_form,
    split_cells,
    trailing_cells,
    uses_decimal_comma,
)
from groundstation.readers.layout import Derivation, Layout, Rule, TimeRule, rule_for
from groundstation.readers.misnamed import misnamed
from groundstation.readers.profile import Profile, load, shipped
from groundstation.readers.source import Claim, Source
from groundstation.readers.start import unusable_references, utc_of_zero

NAME = "csv-profile"
DISTINCTIVE_COLUMNS = 4
DAMAGED_HEAD_LINES = 20  # in which a header row is looked for when the first line is not the profile's
MOST_LINES = 10_000  # in which it is looked for elsewhere
FEWEST_ROWS = 3  # above the header row that are those of another log


@dataclass(frozen=True)
class _Fit:
    """A profile laid over the head of a file: lines down to the last one above the data, and the first rows."""

    profile: Profile
    encoding: str
    delimiter: str
    names: tuple[str, ...]
    above: tuple[Line, ...]
    first_rows: tuple[str, ...]


@cache
def _shipped() -> tuple[Profile, ...]:
    return shipped()


def sniff(source: Source) -> Claim | None:
    """Claim a file whose first line and header row are those of a shipped profile.

    Where the first line is damaged a header row with enough of the profile's columns will do.
    """
    first = source.head[:4096].removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace").lstrip()
    for profile in _shipped():
        if not profile.first_line:
            continue
        if first.startswith(profile.first_line):
            if _fit(source, profile) is not None:
                return Claim(NAME, profile.name, 1.0)
        elif (fit := _fit(source, profile, _limit(source, profile))) is not None and _is_distinctive(fit):
            return Claim(NAME, profile.name, 0.9)
    return None


def _limit(source: Source, profile: Profile) -> int:
    """In how many lines a header row is looked for: below the rows of another log it has its first line above it."""
    return MOST_LINES if b"\n" + profile.first_line.encode() in source.head else DAMAGED_HEAD_LINES


def _is_distinctive(fit: _Fit) -> bool:
    """Whether a header row has enough of the columns that the profile names to be no other table's."""
    return len({rule.name for rule in fit.profile.columns}.intersection(fit.names)) >= DISTINCTIVE_COLUMNS


def claim_by(source: Source, profile: Path) -> Claim:
    """Claim of a file by the user's profile.

    Raises
    ------
    SettingsError
        When the profile cannot be used.
    UnreadableLogError
        When the file has no header row with the columns that the profile asks for.
    """
    loaded = load(profile)
    _fitted(source, loaded)
    return Claim(NAME, loaded.name, 1.0)


def read(source: Source, profile: Path | None = None) -> Iterator[Item]:
    """Yield the header, batches, remarks and damages of a table, by ``profile`` or the shipped one that fits."""
    from groundstation.readers.table_reader import TableReader, truncated_header

    if profile is not None:
        fit = _fitted(source, load(profile))
    else:
        claim = sniff(source)
        if claim is None:
            raise UnreadableLogError(source.name, "no table of a known layout", "", "describe it by a profile")
        fit = _fitted(source, next(known for known in _shipped() if known.name == claim.detail))
    metadata = _metadata(fit)
    utc_of_zero_ns, remarks = _utc_of_zero(fit, metadata)
    layout, layout_remarks = _layout(fit)
    header = LogHeader(f"{NAME} {fit.profile.name}", metadata, utc_of_zero_ns)
    last = fit.above[-1]
    if not last.ended:
        yield header
        yield truncated_header(last.number)
        return
    header_lines = frozenset(normal_form(line.text, fit.delimiter) for line in _of_the_header(fit)) - {""}
    cells = len(fit.names) + trailing_cells(fit.first_rows, fit.delimiter, len(fit.names))
    start = (0, 1) if _has_rows_above(fit, cells) else (last.next_byte, last.number + 1)
    dialect = Dialect(fit.encoding, fit.delimiter, cells, *start, header_lines)
    items = TableReader(source, dialect, layout).items(header)
    yield next(items)
    yield from remarks + layout_remarks + unusable_references(metadata)
    yield from misnamed(items, _slips(fit), last.number - fit.profile.rows_after_header)


def _of_the_header(fit: _Fit) -> tuple[Line, ...]:
    """The header row, what belongs to it, and the lines of comments above it."""
    rows = 1 + fit.profile.rows_after_header
    first = fit.profile.first_line
    is_below = first and any(line.text.lstrip().startswith(first) for line in fit.above[1:])
    return (
        *(line for line in fit.above[:-rows] if not is_below or line.text.lstrip().startswith("#")),
        *fit.above[-rows:],
    )


def _has_rows_above(fit: _Fit, cells: int) -> bool:
    """Whether rows of another log stand above the header; they have its columns."""
    above = set(fit.above) - set(_of_the_header(fit))
    return sum(len(split_cells(line.text, fit.delimiter)) == cells for line in above) >= FEWEST_ROWS


def _fit(source: Source, profile: Profile, limit: int = MOST_LINES) -> _Fit | None:
    """Find the header row: the first one that has every column the profile asks for."""
    encoding = detect_encoding(source.head, source.name)
    lines = head_lines(source, encoding, limit)
    wanted = {*profile.required, *profile.time.columns[:2]}
    for at, line in enumerate(lines):
        for delimiter in DELIMITERS:
            names = tuple(split_cells(line.text, delimiter))
            if wanted.issubset(names):
                start = at + 1 + profile.rows_after_header
                above, below = tuple(lines[:start]), tuple(below.text for below in lines[start:])
                return _Fit(profile, encoding, delimiter, names, above, below)
    return None


def _fitted(source: Source, profile: Profile) -> _Fit:
    fit = _fit(source, profile)
    if fit is None:
        wanted = ", ".join(dict.fromkeys((*profile.required, *profile.time.columns[:2])))
        raise UnreadableLogError(
            source.name,
            f"no header row for profile {profile.name}",
            f"a row with the columns {wanted}",
            f"check {profile.path.name}",
        )
    return fit


def _metadata(fit: _Fit) -> dict[str, str]:
    text = "\n".join(line.text for line in _of_the_header(fit))
    found = dict(fit.profile.constants)
    for key, pattern in fit.profile.find.items():
        match = pattern.search(text)
        if match:
            found[key] = " ".join((match.group(1) or "").split())
    for key, template in fit.profile.join.items():
        names = {name: found.get(name, "") for name in (*fit.profile.find, *fit.profile.constants)}
        found[key] = " ".join(template.format(**names).split())
    units = units_entry(_units(fit))
    return found | {PREFIX + fit.profile.raw_topic: units} if units else found


def _units(fit: _Fit) -> dict[str, str]:
    """Units by column: a comment above the header, or the first row left out below it, that has as many cells."""
    header = len(fit.above) - 1 - fit.profile.rows_after_header
    for line in (*(line for line in fit.above[:header] if line.text.startswith("#")), *fit.above[header + 1 :]):
        cells = [cell.strip() for cell in split_cells(line.text.lstrip("# "), fit.delimiter)]
        if len(cells) == len(fit.names):
            return {name: cell for name, cell in zip(fit.names, cells, strict=True) if name and cell != "-"}
    return {}


def _utc_of_zero(fit: _Fit, metadata: dict[str, str]) -> tuple[int | None, list[Remark]]:
    time = fit.profile.time
    if time.kind == "iso":
        return 0, []
    if time.kind == "local":
        has_offset = len(time.columns) == 3 and time.columns[2] in fit.names
        assumed = Remark("assumed_utc", "date and time have no offset column: read as UTC")
        return 0, [] if has_offset else [assumed]
    return utc_of_zero(metadata)


def _layout(fit: _Fit) -> tuple[Layout, list[Remark]]:
    profile, names = fit.profile, fit.names
    position = {name: at for at, name in reversed(list(enumerate(names))) if name}
    time_names = tuple(name for name in profile.time.columns if name in position)
    time = TimeRule(
        profile.time.kind,  # type: ignore[arg-type]
        tuple(position[name] for name in time_names),
        (", ".join(time_names),),
        *profile.time.unit,
        date_formats=profile.time.date_formats,
    )
    rules = [
        rule_for(position[rule.name], rule.topic, rule.field, rule.factor, rule.offset)
        for rule in profile.columns
        if rule.name in position
    ]
    missing = [rule.name for rule in profile.columns if rule.name not in position]
    derivations = _derivations(profile, rules, position)
    inputs = {given.column for rule in profile.derived for given in rule.inputs}
    taken = {rule.column for rule in rules} | set(time.columns)
    for at, name in enumerate(names):
        if name and at not in taken:
            label = name if position[name] == at else f"{name}_{at + 1}"
            rules.append(Rule(at, profile.raw_topic, label, "double" if label in inputs else "raw"))
    remarks = [
        Remark("missing_columns", f"profile {profile.name} names columns that are not there: {', '.join(missing)}")
    ]
    layout = Layout(time, tuple(rules), derivations, uses_decimal_comma(fit.first_rows, fit.delimiter))
    return layout, remarks if missing else []


def _slips(fit: _Fit) -> dict[tuple[str, str], tuple[str, str]]:
    """Columns that are almost ones of the profile, by raw topic and name: their name, and what was perhaps meant."""
    known = (*(rule.name for rule in fit.profile.columns), *(name for name in fit.profile.time.columns))
    return {(fit.profile.raw_topic, name): (name, meant) for name, meant in slips(fit.names, known).items()}


def _derivations(profile: Profile, rules: list[Rule], columns: Container[str]) -> tuple[Derivation, ...]:
    """Those of the profile's derivations whose inputs the file has."""
    known = {rule.key for rule in rules}
    found: list[Derivation] = []
    for rule in profile.derived:
        if all(given.column in columns if given.column else given.key in known for given in rule.inputs):
            keys, factors = (
                tuple(part) for part in zip(*((given.key, given.factor) for given in rule.inputs), strict=True)
            )
            found.append(Derivation(rule.method, rule.topic, rule.outputs, keys, factors))
            known |= {(rule.topic, name) for name in rule.outputs}
    return tuple(found)
