"""Text of a draft: the guesses of a table as a profile in TOML."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from groundstation.base.toml_text import quoted
from groundstation.readers.drafts.column import ColumnGuess, columns_in_doubt
from groundstation.readers.drafts.sample import TableSample
from groundstation.readers.drafts.time_guess import TimeGuess

MOST_LEFT = 100  # columns left over that the draft lists one by one
_MOST_REQUIRED = 2  # besides the time: another name of any other column is told with the nearest ones


def written(sample: TableSample, time: TimeGuess, columns: Sequence[ColumnGuess]) -> str:
    """Return the draft as TOML."""
    used = [one for one in columns if one.target]
    sides = {one.side for one in used}
    left = [one for one in columns if not one.target and one.name not in sides]
    return "\n".join(
        (
            f"# Draft by `groundstation profile new` for {_comment(sample.name)}.",
            "# Look at each line with a question mark.",
            "# docs/profiles.md has every key; `groundstation profile check` shows what each column becomes.",
            f"name = {quoted(_name_of(sample.name))}",
            *_signs(sample, used),
            "",
            *_recognise(sample, time, used),
            "",
            *(f"# ? {time.doubt}" for _ in range(bool(time.doubt))),
            f"[time]  # {_comment(time.why)}",
            *time.lines,
            *time.metadata,
            *_key(sample),
            *_variation(sample, used),
            "",
            "[columns]",
            *_lines(used),
            *_derived(used),
            *_rest(left),
            "",
        )
    )


def _recognise(sample: TableSample, time: TimeGuess, used: Sequence[ColumnGuess]) -> Iterator[str]:
    yield "[recognise]"
    if sample.header is None:
        if not sample.are_given:
            yield "# ? the table names no columns: draft it again with --names, or name them here and below"
        yield f"names = [{', '.join(map(quoted, sample.names))}]"
        if sample.is_spaced:
            yield 'delimiter = "blanks"'
        return
    places = [one.name for one in used if one.target.endswith(("latitude_deg", "longitude_deg"))]
    needed = (places or [one.name for one in used])[:_MOST_REQUIRED]
    names = [*(sample.names[at] for at in time.columns[:2]), *needed]
    yield f"columns = [{', '.join(map(quoted, dict.fromkeys(names)))}]"
    if sample.is_spaced:
        yield 'delimiter = "blanks"'
    if sample.behind:
        yield f"rows_after_header = {len(sample.behind)}"
    if sample.header.text.startswith("#"):
        yield "header_tells = true"


def _key(sample: TableSample) -> Iterator[str]:
    """Yield the column that tells several vehicles apart."""
    for at, meaning in enumerate(sample.meanings):
        if meaning is not None and meaning.role == "key" and len(set(sample.filled(at))) > 1:
            yield from (
                "",
                "[key]  # ? several vehicles, each a flight of its own",
                f"column = {quoted(sample.names[at])}",
            )
            return


def _signs(sample: TableSample, used: Sequence[ColumnGuess]) -> Iterator[str]:
    """Yield the words and marks for missing values in the columns that become fields."""
    found = sorted({sign for one in used for sign in sample.signs(one.at) - set(sample.number_signs(one.at))})
    if found:
        yield f"missing = [{', '.join(map(quoted, found))}]"


def _variation(sample: TableSample, used: Sequence[ColumnGuess]) -> Iterator[str]:
    at = next((at for at, one in enumerate(sample.meanings) if one is not None and one.role == "variation"), None)
    if at is not None and any(one.north for one in used):
        yield from ("", "[variation]  # ? positive east assumed", f"column = {quoted(sample.names[at])}")


def _lines(used: Sequence[ColumnGuess]) -> Iterator[str]:
    """Yield the lines of the columns.

    A doubt that several share has one line, above the first of them.
    """
    doubts = columns_in_doubt(used)
    for one in used:
        own = [doubt for doubt, names in doubts.items() if names == (one.name,)]
        shared = [doubt for doubt, names in doubts.items() if len(names) > 1 and names[0] == one.name]
        yield from (_comment(f"# ? {', '.join(doubts[doubt])}: {doubt}") for doubt in shared)
        yield _comment_line(one.line_with("; ".join(own)))


def _derived(used: Sequence[ColumnGuess]) -> Iterator[str]:
    """Yield velocities from track and ground speed, where a receiver has no others."""
    targets = {one.target for one in used}
    if {"gnss.track_deg", "gnss.ground_speed_mps"} <= targets and "gnss.velocity_north_mps" not in targets:
        yield from ("", "[[derived]]", 'topic = "gnss"', 'method = "velocity_from_track"')
        yield from ('track = "gnss.track_deg"', 'speed = "gnss.ground_speed_mps"')


def _rest(left: Sequence[ColumnGuess]) -> Iterator[str]:
    """Yield the columns left over, as comments."""
    if not left:
        return
    yield from ("", "# Left, and kept as they are:")
    for one in left[:MOST_LEFT]:
        notes = "; ".join(filter(None, (one.values, one.why, one.doubt)))
        yield _comment_line(f"# {quoted(one.name)}" + (f"  # {notes}" if notes else ""))
    if len(left) > MOST_LEFT:
        yield f"# ... and {len(left) - MOST_LEFT} more"


def _comment(text: str) -> str:
    """Return a text that may stand in a comment: no control characters."""
    return "".join(one if one.isprintable() else "?" for one in text)


def _comment_line(line: str) -> str:
    before, sign, after = line.partition("  # ")
    return before + sign + _comment(after)


def _name_of(file_name: str) -> str:
    """Return the name of a profile after a file.

    Examples
    --------
    >>> _name_of("Flight 3 (log).csv"), _name_of(".csv")
    ('flight-3-log', 'csv')
    """
    stem = Path(file_name).stem.lower()
    return "-".join(re.findall(r"[a-z0-9]+", stem))[:40] or "table"
