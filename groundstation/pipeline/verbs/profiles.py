"""Verbs of ``profile``: profiles written for a table and tried on it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.base.findings import Finding
from groundstation.integrity.ledger_findings import damage_finding
from groundstation.readers.drafts.checked import ProfileCheck as ProfileCheck
from groundstation.readers.drafts.checked import check_profile
from groundstation.readers.drafts.draft import Draft as Draft
from groundstation.readers.drafts.draft import draft_of, facts_of
from groundstation.readers.profile import Profile
from groundstation.readers.profile_heads import SHIPPED
from groundstation.readers.profile_sources import known_as
from groundstation.readers.source import Source
from groundstation.results.files import write_text


@dataclass(frozen=True)
class KnownProfile:
    """Profile that is tried on every table: its name, a line on it, and its origin."""

    name: str
    summary: str
    origin: str


def new_profile(table: Path, names: Sequence[str] = ()) -> Draft:
    """Return the draft of a profile for a table, with names for one that has none.

    Raises
    ------
    UsageError
        When there is no such file.
    UnreadableLogError
        When it is no table, or has no time that can be read.
    """
    return draft_of(Source(_file(table)), names)


def write_profile(draft: Draft, path: Path) -> None:
    """Write a draft into a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, draft.text)


def try_profile(profile: Path, table: Path) -> ProfileCheck:
    """Read a table by a profile, and tell what each column became.

    Raises
    ------
    UsageError
        When there is no such file, or the profile cannot be used.
    UnreadableLogError
        When the table has no header row of the profile, or cannot be read.
    """
    return check_profile(_file(known_as(profile)), _file(table))


def known_profiles() -> tuple[tuple[KnownProfile, ...], tuple[str, ...]]:
    """Return the profiles tried on every table, and a line for each that cannot be used."""
    from groundstation.readers.profile_sources import known_profiles as tried_profiles
    from groundstation.readers.profile_sources import other_profiles

    found = tuple(KnownProfile(one.name, one.description, _origin(one)) for one in tried_profiles())
    return found, other_profiles().failures


def _origin(profile: Profile) -> str:
    return "built in" if profile.path.parent == SHIPPED else str(profile.path)


def findings_of(check: ProfileCheck) -> tuple[Finding, ...]:
    """Return the findings of a check: columns missing or unread, and what the reader told."""
    missing = (Finding("warn", "profile.missing_column", one.text) for one in check.missing)
    causes = (Finding("warn", "profile.unread_column", one) for one in check.causes)
    lost = map(damage_finding, check.damages)
    told = (
        Finding("warn" if one.code == "unchecked_draft" else "info", f"reader.{one.code}", one.text, one.topic)
        for one in check.remarks
    )
    return (*missing, *causes, *lost, *told)


def facts_of_draft(draft: Draft) -> Mapping[str, Any]:
    """Return a draft and what it understood as plain values."""
    return facts_of(draft)


def _file(path: Path) -> Path:
    if not path.exists():
        raise UsageError(str(path), "no such file")
    if path.is_dir():
        raise UsageError(str(path), "a folder", "a file")
    return path


def folder_of_the_user() -> Path:
    """Return the folder whose profiles are tried on every table."""
    from groundstation.readers.profile_sources import user_folder

    return user_folder()
