"""Tables of any layout, described by a TOML profile: a shipped one, or the user's.

``record_index`` is the line number in the file (from 1). Columns that the profile does not name are kept under the
profile's raw topic.
"""

from collections.abc import Iterator
from pathlib import Path

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Item
from groundstation.readers.profile_heads import that_may_fit
from groundstation.readers.profile_sources import READER, known_as, other_profiles
from groundstation.readers.source import Claim, Source

NAME = READER


def sniff(source: Source) -> Claim | None:
    """Claim a file whose first line and header row are those of a shipped profile.

    Where the first line is damaged, a header row with enough of the profile's columns will do. Among the profiles of a
    family, the file goes to the one whose header row stands first, or to the one that has the long names of that row
    below it.
    """
    if not (other_profiles().profiles or that_may_fit(source)):
        return None
    from groundstation.readers.profile_match import best_fit

    found = best_fit(source)
    return None if found is None else Claim(NAME, found[1].profile.name, found[0])


def claim_by(source: Source, profile: Path) -> Claim:
    """Claim a file by the user's profile.

    Raises
    ------
    SettingsError
        When the profile cannot be used.
    UnreadableLogError
        When the file has no header row with the columns that the profile asks for.
    """
    from groundstation.readers.profile_file import load
    from groundstation.readers.profile_match import fitted

    loaded = load(known_as(profile))
    source.seen[profile] = fitted(source, loaded)
    return Claim(NAME, loaded.name, 1.0)


def read(source: Source, profile: Path | None = None) -> Iterator[Item]:
    """Yield the header, batches, remarks and damage of a table.

    It is read by ``profile``, or by the shipped profile that fits.
    """
    from groundstation.readers.profile_file import load
    from groundstation.readers.profile_match import best_fit, fitted, with_joined
    from groundstation.readers.profile_table import items

    if profile is not None:
        fit = source.seen.pop(profile, None) or fitted(source, load(known_as(profile)))  # as just claimed
    else:
        found = best_fit(source)
        if found is None:
            raise UnreadableLogError(source.name, "no table of a known layout", "", "describe it by a profile")
        fit = found[1]
    try:
        yield from items(source, with_joined(source, fit))
    finally:
        source.seen.clear()
