"""Names that the shell completes: scenarios, studies, analyses, profiles."""

from collections.abc import Callable, Iterator
from pathlib import Path


def scenarios(incomplete: str) -> list[str]:
    """Return scenarios of flights and sessions, and TOML files, that begin so."""
    return _begin(incomplete, "scenario", "session") + _files(incomplete)


def studies(incomplete: str) -> list[str]:
    """Return studies that begin so."""
    return _begin(incomplete, "study")


def analyses(incomplete: str) -> list[str]:
    """Return analyses of flights and sessions that begin so."""
    return _begin(incomplete, "analysis")


def plans_of(verb: str) -> Callable[[str], list[str]]:
    """Return what completes the scenarios of a verb of ``plan``, and TOML files."""

    def plans(incomplete: str) -> list[str]:
        names = (name.removeprefix(f"{verb} ") for name in _names("plan") if name.startswith(f"{verb} "))
        return [name for name in names if name.startswith(incomplete)] + _files(incomplete)

    return plans


def profiles(incomplete: str) -> list[str]:
    """Return profiles, shipped, the user's and TOML files, that begin so."""
    from groundstation.pipeline.verbs.profiles import known_profiles

    return [one.name for one in known_profiles()[0] if one.name.startswith(incomplete)] + _files(incomplete)


def _files(incomplete: str) -> list[str]:
    head = incomplete[: incomplete.rfind("/") + 1]  # as typed: the shell keeps it
    folder = Path(head or ".")
    if not folder.is_dir():
        return []
    return sorted(name for one in folder.glob("*.toml") if (name := head + one.name).startswith(incomplete))


def _begin(incomplete: str, *kinds: str) -> list[str]:
    return [name for name in _names(*kinds) if name.startswith(incomplete)]


def _names(*kinds: str) -> Iterator[str]:
    from groundstation.pipeline.verbs.catalogue import catalogue

    return (str(entry["name"]) for entry in catalogue() if entry["kind"] in kinds)
