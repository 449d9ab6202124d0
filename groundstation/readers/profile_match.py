"""Match of known profiles to a table: the one that fits, and its header row."""

import re
from collections.abc import Sequence
from dataclasses import replace

from groundstation.base.errors import UnreadableLogError
from groundstation.readers.dialect import HeadLine, detect_encoding, head_lines, split_cells
from groundstation.readers.profile import Profile
from groundstation.readers.profile_fit import Fit, delimiter_of, delimiters_of, fit_at, joined_gaps
from groundstation.readers.profile_heads import DAMAGED_HEAD_LINES, are_named, beginning_of, that_may_fit
from groundstation.readers.profile_sources import profiles_for
from groundstation.readers.source import Source
from groundstation.readers.spaced import FixedSource, SpacedSource

DISTINCTIVE_COLUMNS = 4
MOST_LINES = 10_000  # lines searched for it otherwise
_HEAD_LINES = 1000
_A_NUMBER = re.compile(r"\s*[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?\s*")


def best_fit(source: Source) -> tuple[float, Fit] | None:
    """Return the shipped profile that fits a file, and how sure that is."""
    begins = beginning_of(source)
    profiles = profiles_for(that_may_fit(source))
    is_one = any(begins.first.startswith(profile.first_lines) for profile in profiles if profile.first_lines)
    encoding = detect_encoding(source.head, source.name)
    below = {profile.name for profile in profiles if begins.is_above(profile.first_lines)}
    most = MOST_LINES if below else _HEAD_LINES if is_one else DAMAGED_HEAD_LINES
    lines = head_lines(source, encoding, most)
    found: list[tuple[float, Fit]] = []
    last = len(lines)  # a relative has its header near by
    for profile in profiles:
        is_its_own = begins.is_that_of(profile.first_lines)
        is_near = not is_its_own and profile.name not in below
        if is_near and not are_named(profile.required, lines):
            continue
        profile = profile.for_file(source.name)
        seen = head_lines(seen_as(source, profile), encoding, most) if profile.is_spaced else lines
        if not profile.first_lines:
            fit = _named_by(profile, encoding, seen)
            found += [(1.0, fit)] if fit is not None else []
            continue
        if profile.names:
            fit = _without_header(profile, encoding, seen) if is_its_own else None
        else:
            fit = _fit(profile, encoding, seen[: min(last, DAMAGED_HEAD_LINES) if is_near else last])
        count = 0 if fit is None else sum(rule.name in fit.position for rule in profile.columns)
        if fit is not None and (is_its_own or count >= DISTINCTIVE_COLUMNS):
            found.append((1.0 if is_its_own else 0.9, fit))
            last = min(last, fit.header.number + DAMAGED_HEAD_LINES)
    best = max(found, key=lambda one: (one[0], -one[1].header.number), default=None)
    for one in found:
        if best is not None and one[1].header in best[1].behind and one[1].told_count > best[1].told_count:
            return one
    return best


def _named_by(profile: Profile, encoding: str, lines: Sequence[HeadLine]) -> Fit | None:
    """Match a profile without a first line to a table that has all columns it needs."""
    fit = None if profile.names else _fit(profile, encoding, lines)
    wanted = [name for rule in profile.columns if not rule.is_optional for name in rule.names]
    is_all = fit is not None and all(name in fit.position for name in wanted)
    return fit if is_all and len({*wanted, *profile.required}) >= DISTINCTIVE_COLUMNS - 1 else None


def _fit(profile: Profile, encoding: str, lines: Sequence[HeadLine]) -> Fit | None:
    """Find the header row: the first one that has every column the profile asks for."""
    for at, line in enumerate(lines):
        delimiter = delimiter_of(line.text, profile)
        if delimiter:
            return fit_at(profile, encoding, delimiter, lines, at)
    return None


def seen_as(source: Source, profile: Profile, cells: int = 0, joined: tuple[int, ...] = ()) -> Source:
    """Return the source with tabs for blanks, or between columns of fixed width."""
    if not profile.is_spaced:
        return source
    key = profile.widths, cells, joined
    if key not in source.seen:
        source.seen[key] = (
            FixedSource(source.path, source, profile.widths)
            if profile.widths
            else SpacedSource(source.path, source, cells, joined)
        )
    found: Source = source.seen[key]
    return found


def with_joined(source: Source, fit: Fit) -> Fit:
    """Return a match whose rows have degrees, minutes and seconds in one cell.

    It is the match itself where the names do not ask for that."""
    cells, joined = joined_gaps(fit.profile, fit.names, fit.first_rows)
    if not joined or fit.profile.names:
        return fit
    lines = head_lines(seen_as(source, fit.profile, cells, joined), fit.encoding, MOST_LINES)
    again = fit_at(fit.profile, fit.encoding, fit.delimiter, lines, fit.header.number - 1)
    return replace(again, cells=cells, joined=joined)


def _without_header(profile: Profile, encoding: str, lines: Sequence[HeadLine]) -> Fit | None:
    """Match a profile to a file without a header, most of whose first lines are rows of it.

    Text may stand above them; what looks like rows and does not fit is counted as lost.
    """
    for delimiter in delimiters_of(profile):
        top = HeadLine(0, 0, "", ended=True)
        fit = Fit(profile, encoding, delimiter, profile.names, top)
        at = next((place for place, line in enumerate(lines) if fit.is_row(line.text)), 0)
        if all(_is_of_text(line.text, delimiter) for line in lines[:at]):
            top = lines[at - 1] if at else top
        else:
            at = next((place for place, line in enumerate(lines) if not line.text.startswith("#")), len(lines))
            top = lines[at - 1] if at else top
        rows = tuple(line.text for line in lines[at : at + DAMAGED_HEAD_LINES] if line.text.strip())
        header = HeadLine(top.number, top.next_byte, "", ended=True)
        fit = replace(fit, header=header, above=tuple(lines[:at]), first_rows=rows)
        if rows and 2 * sum(map(fit.is_whole, rows)) >= len(rows):
            return fit
    return None


def _is_of_text(line: str, delimiter: str) -> bool:
    """Tell whether a line has no cell that is a number: it is no row that was torn."""
    return line.startswith("#") or not any(_A_NUMBER.fullmatch(cell) for cell in split_cells(line, delimiter))


def fitted(source: Source, profile: Profile) -> Fit:
    profile = profile.for_file(source.name)
    encoding = detect_encoding(source.head, source.name)
    if profile.names:
        found = _without_header(profile, encoding, head_lines(seen_as(source, profile), encoding))
        if found is None:
            expected = f"rows of {len(profile.names)} cells, numbers or times"
            raise UnreadableLogError(
                source.name, f"no row for profile {profile.name}", expected, f"check {profile.path.name}"
            )
        return found
    fit = _fit(profile, encoding, head_lines(seen_as(source, profile), encoding, MOST_LINES))
    if fit is None:
        from groundstation.readers.drafts.nearest import why_no_header

        wanted = ", ".join(dict.fromkeys((*profile.required, *profile.time.asked)))
        told = "; ".join(
            filter(
                None, (f"no header row for profile {profile.name}", why_no_header(seen_as(source, profile), profile))
            )
        )
        raise UnreadableLogError(source.name, told, f"a row with the columns {wanted}", f"check {profile.path.name}")
    return fit
