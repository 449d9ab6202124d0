"""Settings of the user: estimators, aircraft and site files, intervals. Strictly checked.

The user may leave out or force intervals. The analyses are imported when their settings are asked for, or when the user
gives any: a log is converted without.
"""

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from datetime import datetime
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError, UsageError
from groundstation.base.toml_settings import settings_from
from groundstation.base.toml_text import toml_table, toml_text
from groundstation.integrity.limits import Thresholds, thresholds_from
from groundstation.pipeline.one_flight.isolation import Isolation
from groundstation.pipeline.one_flight.layout import KindOfRecording, SavedLayout

if TYPE_CHECKING:
    from groundstation.results.installations import Lesson
    from groundstation.systems.applied import Asked
    from groundstation.systems.known import AircraftData, SiteData
    from groundstation.systems.system import Systems
    from groundstation.tables.session_settings import SessionSettings

ISOLATION = "isolation"  # the table that changes no result: it is not kept
S = TypeVar("S")
LISTS = ("exclude", "force", "weather", "without")  # what a settings file may hold besides tables
Settings = Path | Mapping[str, Any]  # a TOML file, or its content


@cache
def session_tables() -> tuple[str, ...]:
    """Names of the settings tables of a session."""
    from groundstation.systems import systems

    return (*(analysis.settings_table for analysis in systems().session_analyses), "session")


@cache
def tables() -> tuple[str, ...]:
    """Names of all settings tables."""
    from groundstation.systems import systems

    of_flights = dict.fromkeys(analysis.settings_table for analysis in systems().analyses)
    return (*of_flights, *session_tables(), "aircraft", "site", "thresholds", "rules")


@cache
def sections() -> tuple[str, ...]:
    """Return names of all that a settings file may hold."""
    return (*tables(), ISOLATION, *LISTS)


@dataclass(frozen=True)
class WrittenInterval:
    """Part of a flight that the user excludes or forces.

    Its ends are as written: flight seconds, +mm:ss or ISO UTC.
    """

    start: str
    end: str
    reason: str = ""


@dataclass(frozen=True)
class RulesLabel:
    """Name that a settings file gives its limits.

    The manifest keeps it and ``rules test`` shows it; it changes no result.
    """

    version: str = ""
    note: str = ""


@dataclass(frozen=True)
class UserSettings:
    """Settings of the user as dataclasses, with shipped values where nothing is set.

    ``analyses`` holds the settings of every analysis by the name of their table.
    """

    analyses: Mapping[str, Any]
    aircraft: "AircraftData"
    site: "SiteData"
    session: "SessionSettings"

    def of(self, kind: type[S]) -> S:
        """Return the settings of that type."""
        return next(found for found in self.analyses.values() if isinstance(found, kind))


@dataclass(frozen=True)
class References:
    """Files that may judge flights.

    ``is_expected``: it is an error when none is of the time of the one log named. ``topic`` is the one that judges;
    empty: the best of each file.
    """

    paths: tuple[Path, ...] = ()
    is_expected: bool = False
    topic: str = ""

    def besides(self, log: Path) -> "References":
        """Return these files without the log itself, which judges nothing.

        A log that is the only file stays.
        """
        others = tuple(path for path in self.paths if path.resolve() != log.resolve())
        return replace(self, paths=others or self.paths)


NO_REFERENCES = References()


@dataclass(frozen=True)
class Configuration:
    """All settings of a user for a run.

    Parsed once, when it is made; worker processes get the values.

    Parameters
    ----------
    tables : mapping
        The TOML tables as written, by name: those of the analyses, ``aircraft``, ``site``, ``thresholds``,
        ``rules`` and ``isolation``.
    exclude, force : tuple of WrittenInterval
    profile : str, optional
        Path of the layout of logs that no reader knows.
    icds : tuple of str
        Files, or names of shipped ones, that tell what the words of a recording's buses mean.
    files : mapping
        The file that a table was read from, for messages.
    apply : Asked, optional
        What a step behind the analyses is to apply: the deviation to add to the magnetic heading.
    references : References
        Files of which the one of the log's time judges the answers.
    weather : tuple of str
        METAR lines; each flight takes the wind of the one nearest to its taxi.
    lessons : tuple of Lesson, optional
        What earlier flights say of installations, from an installations.json.
    without : tuple of str
        Analyses that are left out.
    layouts : tuple of SavedLayout
        What the recordings show in place of the default tabs, at most one for each kind of recording.

    Raises
    ------
    SettingsError
        For an unknown key or a value that cannot be used, naming file and key.
    """

    tables: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    exclude: tuple[WrittenInterval, ...] = ()
    force: tuple[WrittenInterval, ...] = ()
    profile: str | None = None
    icds: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    apply: "Asked | None" = None
    references: References = NO_REFERENCES
    weather: tuple[str, ...] = ()
    lessons: "tuple[Lesson, ...] | None" = None
    without: tuple[str, ...] = ()
    layouts: tuple[SavedLayout, ...] = ()

    def __post_init__(self) -> None:
        self.thresholds  # noqa: B018 -- raises now if a value is wrong
        self.rules  # noqa: B018
        self.isolation  # noqa: B018
        if not self._is_as_shipped:
            self.settings  # noqa: B018

    @cached_property
    def thresholds(self) -> Thresholds:
        """Limits of the integrity ledger."""
        return thresholds_from(self.tables.get("thresholds", {}), self._file_of("thresholds"), "thresholds")

    @cached_property
    def rules(self) -> RulesLabel:
        """Name of the limits."""
        return self._table("rules", RulesLabel)

    @cached_property
    def isolation(self) -> Isolation:
        """Bounds of a log that is read in a process of its own."""
        return self._table(ISOLATION, Isolation)

    @cached_property
    def settings(self) -> UserSettings:
        """Settings of the analyses, the aircraft, the site and the session."""
        from groundstation.systems import systems

        return self._settings(systems())

    def settings_among(self, among: "Systems") -> UserSettings:
        """Return the settings with those of the analyses of some systems alone.

        Where the user states any they are those of all, which are checked together.
        """
        return self._settings(among) if self._is_as_shipped else self.settings

    @cached_property
    def aircraft(self) -> "AircraftData":
        """Knowledge of the aircraft."""
        from groundstation.systems.known import AircraftData

        return self._table("aircraft", AircraftData)

    @property
    def _is_as_shipped(self) -> bool:
        return not self.tables.keys() - {"thresholds", "rules", ISOLATION}

    def _settings(self, among: "Systems") -> UserSettings:
        from groundstation.systems.known import SiteData
        from groundstation.tables.session_settings import SessionSettings

        types = {analysis.settings_table: analysis.settings for analysis in (*among.analyses, *among.session_analyses)}
        settings = UserSettings(
            {name: self._table(name, kind) for name, kind in types.items()},
            self.aircraft,
            self._table("site", SiteData),
            self._table("session", SessionSettings),
        )
        for analysis in among.analyses:
            analysis.check(settings.analyses[analysis.settings_table], settings.aircraft)
        return settings

    def _table(self, name: str, kind: type[S]) -> S:
        table = self.tables.get(name)
        return settings_from(kind, table, self._file_of(name), name) if table else kind()

    def _file_of(self, table: str) -> str:
        return self.files.get(table, "settings")

    @property
    def profile_path(self) -> Path | None:
        """The profile as a path."""
        return Path(self.profile) if self.profile else None

    def layout_of(self, kind: KindOfRecording) -> SavedLayout | None:
        """Return the saved layout of a kind of recording; None where it keeps its own."""
        return next((one for one in self.layouts if one.of == kind), None)

    def layout_bytes(self, kind: KindOfRecording) -> bytes:
        """Content of the saved layout of a kind of recording; empty where it keeps its own."""
        found = self.layout_of(kind)
        return b"" if found is None else found.content

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for the manifest and the MCAP; only what the user set."""
        document: dict[str, Any] = {name: dict(self.tables[name]) for name in tables() if self.tables.get(name)}
        for name in ("exclude", "force"):
            intervals = [{"from": part.start, "to": part.end, "reason": part.reason} for part in getattr(self, name)]
            if intervals:
                document[name] = intervals
        if self.profile:
            document["profile"] = Path(self.profile).name
        if self.icds:
            document["icds"] = [Path(one).name for one in self.icds]
        if self.apply:
            document["apply"] = self.apply.to_dict()
        if self.weather:
            document["weather"] = list(self.weather)
        if self.without:
            document["without"] = list(self.without)
        if self.layouts:
            document["layouts"] = {one.of: one.name for one in self.layouts}
        if self.references.paths:
            document["references"] = [path.name for path in self.references.paths]
        return document


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    SettingsError
        When the file cannot be read or is not TOML.
    """
    what = ("a TOML file", "see docs/configuration.md")
    return toml_table(toml_text(path, str(path), *what), str(path), *what)


def load_configuration(
    config: Settings | None = None,
    aircraft: Settings | None = None,
    site: Settings | None = None,
    intervals: Settings | None = None,
    profile: Path | None = None,
    thresholds: Settings | None = None,
    icds: Iterable[str] | None = None,
    weather: Settings | None = None,
    without: Iterable[str] | None = None,
) -> Configuration:
    """Put the user's settings, files or their content, into one configuration.

    What is given for a section wins over that section of ``config``.

    Raises
    ------
    SettingsError
        For an unreadable file, an unknown section, or a value of the wrong kind, naming file and key.
    """
    if icds:
        _refuse_wrong(icds)
    document = _content(config) if config else {}
    if config:
        _refuse_unknown(document, sections(), _name(config))
    own = {"aircraft": aircraft, "site": site, "thresholds": thresholds}
    for name, path in own.items():
        if path:
            document[name] = _content(path)
    files = {name: own.get(name) or config for name in document}
    if intervals:
        listed = _content(intervals)
        _refuse_unknown(listed, ("exclude", "force"), _name(intervals))
        document.update(listed)
    given = {name: content for name, content in document.items() if name not in LISTS}
    for name, content in given.items():
        if not isinstance(content, Mapping):
            raise SettingsError(f"{_name(config)}, {name}", repr(content), f"a table [{name}]")
    return Configuration(
        given,
        exclude=_intervals(document.get("exclude", []), f"{_name(intervals or config)}, exclude"),
        force=_intervals(document.get("force", []), f"{_name(intervals or config)}, force"),
        profile=str(profile) if profile else None,
        icds=tuple(icds or ()),
        files={name: str(path) for name, path in files.items() if isinstance(path, Path)},
        weather=_weather(document.get("weather", []), weather, _name(config)),
        without=_left_out(document.get("without", []), without, _name(config)),
    )


def _left_out(listed: Any, given: Iterable[str] | None, name: str) -> tuple[str, ...]:
    """Return the names of the analyses that are left out.

    They are those of a settings file and of the command line.
    """
    if not isinstance(listed, list) or not all(isinstance(one, str) for one in listed):
        raise SettingsError(f"{name}, without", repr(listed), "a list of names of analyses")
    found = tuple(dict.fromkeys([*listed, *(given or ())]))
    if not found:
        return ()
    from groundstation.systems import systems

    known = [analysis.name for analysis in systems().analyses]
    for one in found:
        if one not in known:
            raise SettingsError("without", repr(one), f"one of {', '.join(known)}")
    return found


def installed_as(configuration: Configuration, installation: Path | None) -> Configuration:
    """Return the configuration with what earlier flights taught about installations.

    Unchanged without a file.

    Raises
    ------
    SettingsError
        When it is no installations.json that can be read.
    """
    if installation is None:
        return configuration
    from groundstation.results.installations import read_installations

    return replace(configuration, lessons=read_installations(installation).lessons)


def applying(configuration: Configuration, apply: str) -> Configuration:
    """Return the configuration with a deviation to add to the magnetic heading.

    Unchanged where ``apply`` is empty. ``apply`` is ``own``, or names a flight folder, its summary.json or a
    deviation.csv.

    Raises
    ------
    UsageError
        When it names nothing that holds a deviation.
    """
    if not apply:
        return configuration
    from groundstation.systems import systems

    step = systems().apply
    if step is None:
        raise UsageError(f"--apply {apply}", "no system that applies anything")
    return replace(configuration, apply=step.read(apply))


def _refuse_wrong(icds: Iterable[str]) -> None:
    """Refuse a misspelt ICD name before anything is read."""
    from groundstation.readers.icd import named_icd

    for one in icds:
        named_icd(one)


def _content(settings: Settings) -> dict[str, Any]:
    return read_toml(settings) if isinstance(settings, Path) else dict(settings)


def _name(settings: Settings | None) -> str:
    return str(settings) if isinstance(settings, Path) else "settings"


def _refuse_unknown(document: Mapping[str, Any], known: Iterable[str], where: str) -> None:
    unknown = sorted(set(document) - set(known))
    if unknown:
        raise SettingsError(where, f"unknown key {unknown[0]!r}", "one of " + ", ".join(sorted(known)))


def _intervals(listed: Any, where: str) -> tuple[WrittenInterval, ...]:
    if not isinstance(listed, list) or not all(isinstance(part, dict) for part in listed):
        raise SettingsError(where, repr(listed), "tables such as [[exclude]] with from and to")
    for part in listed:
        _refuse_unknown(part, ("from", "to", "reason"), where)
        if not {"from", "to"} <= set(part):
            raise SettingsError(where, repr(part), "from and to: flight seconds, +mm:ss or ISO UTC")
    return tuple(
        WrittenInterval(_time(part["from"], where), _time(part["to"], where), str(part.get("reason", "")))
        for part in listed
    )


def _weather(listed: Any, given: Settings | None, where: str) -> tuple[str, ...]:
    """Return METAR lines with a wind: from the text file or mapping given, else the settings."""
    file = given if isinstance(given, Path) else None
    if file is not None:
        listed, where = toml_text(file, str(file), "a text file", "METAR lines").splitlines(), str(file)
    elif isinstance(given, Mapping):
        listed = given.get("weather", [])
    if not isinstance(listed, list) or not all(isinstance(line, str) for line in listed):
        raise SettingsError(f"{where}, weather", repr(listed), "a list of METAR lines")
    if file is None and not listed:
        return ()
    from groundstation.base.metar import metar_wind

    lines = tuple(line.strip() for line in listed if metar_wind(line) is not None)
    if file is not None and not lines:
        raise SettingsError(where, "no METAR line with a wind", "lines such as UUEE 040600Z 27010MPS CAVOK 12/05 Q1013")
    return lines


def _time(value: Any, where: str) -> str:
    """Return a time as text; refuse text that is no time in any flight.

    It is refused before the work begins.
    """
    from groundstation.pipeline.one_flight.intervals import flight_seconds

    if isinstance(value, bool) or not isinstance(value, int | float | str | datetime):
        raise SettingsError(where, repr(value), "flight seconds, +mm:ss or ISO UTC")
    try:
        flight_seconds(str(value), 0, True)
    except SettingsError as error:
        raise SettingsError(where, repr(str(value)), "flight seconds, +mm:ss or ISO UTC") from error
    return str(value)
