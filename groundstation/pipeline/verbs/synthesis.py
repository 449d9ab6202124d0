"""Simulated logs and Monte Carlo studies as files.

The runs of a study are kept in its folder, so that a stopped study continues.
"""

import json
import shlex
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

from groundstation.base.errors import UsageError
from groundstation.base.serial import from_json, to_json_exactly
from groundstation.base.version import __version__
from groundstation.pipeline.many_flights.inputs import STUDY_MARK
from groundstation.pipeline.one_flight.configuration import read_toml
from groundstation.pipeline.one_flight.progress import Event, Listener
from groundstation.systems import systems

if TYPE_CHECKING:
    from groundstation.systems.study import StudyResult
    from groundstation.systems.system import Study
R = TypeVar("R")


Form = Literal["csv", "ch10", "ulog", "dataflash", "ros1"]
Kind = Literal["imu", "fleet", "session", "approach", "units", "flight"]  # of a scenario
EVIDENCE = "evidence.md"
SUFFIXES: Mapping[Form, str] = MappingProxyType({"csv": "csv", "ulog": "ulg", "dataflash": "BIN", "ros1": "bag"})


def simulate_to(
    scenario: str, folder: Path, *, seed: int | None = None, form: Form = "csv", force: bool = False
) -> list[Path]:
    """Simulate a scenario (a shipped name or a TOML file) into ``<folder>/<scenario>.csv``.

    With ``form`` ch10 it is ``<scenario>.ch10``, and the ICD of its buses ``<scenario>.icd.yaml``. A session of several
    aircraft gives one log for each, ``<folder>/<session>-<aircraft>.csv``, with stations.toml and settings.toml beside
    them; a fleet gives a log for each flight, ``<folder>/<fleet>-<period>-<flight>.csv``; landing aids give the site
    file that belongs to them, ``<scenario>.site.toml``. A log of an inertial unit can be ULog
    (``.ulg``), DataFlash (``.BIN``) or a ROS 1 bag as well, with ``<scenario>.truth.csv`` beside it.

    Raises
    ------
    UsageError
        When the log is there already and ``force`` is not given, there is no such scenario, or it has no such form.
    """
    from groundstation.results.files import write_text
    from groundstation.simulation.chapter10_writer import write_chapter10
    from groundstation.simulation.flight import simulate
    from groundstation.simulation.landing_aids import site_of
    from groundstation.simulation.samples import write_log
    from groundstation.simulation.scenario import load_scenario

    kind = kind_of(scenario)
    if kind == "imu":
        return _imu_to(scenario, folder, seed, form, force=force)
    if form not in {"csv", "ch10"}:
        raise UsageError(scenario, f"--format {form}", "csv or ch10, or a scenario of an inertial unit (imu-uav)")
    if kind != "flight":
        if form != "csv":
            raise UsageError(scenario, f"--format {form}", "a scenario of one flight")
        return _WRITERS[kind](scenario, folder, seed, force=force)
    loaded = load_scenario(scenario)
    target = folder / f"{loaded.name}.{form}"
    _require_free([target], force=force)
    simulated = simulate(loaded, seed)
    site = site_of(simulated.trajectory, loaded)
    if form == "csv":
        paths = [write_log(simulated, folder)]
    else:
        folder.mkdir(parents=True, exist_ok=True)
        icd, _left_out = write_chapter10(target, simulated.damaged, cut_bytes=loaded.log.cut_bytes)
        paths = [target, icd]
    if site:
        paths.append(folder / f"{loaded.name}.site.toml")
        write_text(paths[-1], site)
    return paths


def kind_of(scenario: str) -> Kind:
    """Return the kind of a scenario: of a shipped name, or by the tables of a TOML file.

    Raises
    ------
    UsageError
        For a file that is no TOML.

    Examples
    --------
    >>> kind_of("imu-uav"), kind_of("taxi-good")
    ('imu', 'flight')
    """
    from groundstation.simulation.approach import approach_names
    from groundstation.simulation.imu.scenario import imu_scenario_names
    from groundstation.simulation.ins_units.fleet import units_fleet_names
    from groundstation.simulation.ins_units.scenario import units_scenario_names
    from groundstation.simulation.session_scenario import session_names

    shipped: Mapping[Kind, Callable[[], tuple[str, ...]]] = {
        "imu": imu_scenario_names,
        "fleet": units_fleet_names,
        "session": session_names,
        "approach": approach_names,
        "units": units_scenario_names,
    }
    if not scenario.endswith(".toml"):
        return next((kind for kind, names in shipped.items() if scenario.lower() in names()), "flight")
    path = Path(scenario)
    table = read_toml(path) if path.is_file() else {}
    flown = table.get("flown")
    told: Mapping[Kind, bool] = {
        "imu": "family" in table,
        "fleet": isinstance(flown, list),
        "session": isinstance(table.get("aircraft"), list),
        "approach": isinstance(table.get("recorded"), dict),
        "units": isinstance(flown, dict) and "units" in flown,
    }
    return next((kind for kind, is_so in told.items() if is_so), "flight")


def _require_free(paths: Iterable[Path], *, force: bool) -> None:
    """Refuse to write over a log that is there, unless forced to."""
    there = next((path for path in paths if path.exists()), None)
    if there is not None and not force:
        raise UsageError(str(there), "a file that exists", "a new folder", "-f overwrites it")


def _imu_to(name: str, folder: Path, seed: int | None, form: Form, *, force: bool) -> list[Path]:
    from groundstation.simulation.imu.dataflash import write_dataflash
    from groundstation.simulation.imu.ros_bag import write_ros1
    from groundstation.simulation.imu.scenario import fly, load_imu_scenario
    from groundstation.simulation.imu.tables import write_csv, write_truth
    from groundstation.simulation.imu.ulog import write_ulog

    writers = {"csv": write_csv, "ulog": write_ulog, "dataflash": write_dataflash, "ros1": write_ros1}
    if form not in writers:
        raise UsageError(name, f"--format {form}", f"one of {', '.join(writers)}")
    scenario = load_imu_scenario(name)
    paths = [folder / f"{scenario.name}.{SUFFIXES[form]}"]
    if form != "csv" and scenario.truth_rate_hz > 0.0:
        paths.append(folder / f"{scenario.name}.truth.csv")
    _require_free(paths, force=force)
    folder.mkdir(parents=True, exist_ok=True)
    flight = fly(scenario, seed)
    for path, write in zip(paths, (writers[form], write_truth), strict=False):
        write(path, flight, scenario)
    return paths


def _approach_to(name: str, folder: Path, seed: int | None, *, force: bool) -> list[Path]:
    from groundstation.simulation.approach import load_approach, write_approach

    scenario = load_approach(name)
    _require_free([folder / f"{scenario.name}.csv"], force=force)
    return [write_approach(scenario, folder, seed)]


def _units_to(name: str, folder: Path, seed: int | None, *, force: bool) -> list[Path]:
    from groundstation.simulation.ins_units.log import write_units
    from groundstation.simulation.ins_units.scenario import load_units_scenario

    scenario = load_units_scenario(name)
    _require_free([folder / scenario.log_name], force=force)
    return [write_units(scenario, folder, seed)]


def _units_fleet_to(name: str, folder: Path, seed: int | None, *, force: bool) -> list[Path]:
    from groundstation.simulation.ins_units.fleet import load_units_fleet, write_units_fleet

    fleet = load_units_fleet(name)
    _require_free((folder / one.log_name for one in fleet.scenarios()), force=force)
    return write_units_fleet(fleet, folder, seed)


def _session_to(name: str, folder: Path, seed: int | None, *, force: bool) -> list[Path]:
    from groundstation.simulation.session_log import session_paths, write_session
    from groundstation.simulation.session_scenario import load_session

    scenario, stem = load_session(name), Path(name).stem.lower()
    _require_free(session_paths(scenario, folder, stem), force=force)
    return write_session(scenario, folder, stem, seed)


_WRITERS = {"fleet": _units_fleet_to, "session": _session_to, "approach": _approach_to, "units": _units_to}


def study_to(
    name: str,
    folder: Path,
    *,
    runs: int,
    seed: int,
    force: bool,
    listen: Listener,
    inputs: Path | None = None,
    minutes: float | None = None,
) -> str:
    """Run a study into a folder: its page, tables and evidence.md; return the page's text.

    The page is ``<name>.md``, the tables tables/*.csv; evidence.md is the page with its provenance, for docs/evidence/.
    ``inputs`` are the files of a study that reads some. Where a study keeps its runs, they are in ``runs/``: the same
    command goes on with them, ``minutes`` ends it before all are made; ``force`` makes them afresh.

    Raises
    ------
    UsageError
        When the page is there already and ``force`` is not given, there is no such study, it lacks its files, or it
        reads none.
    """
    from groundstation.results.files import csv_text, write_text

    found = next((one for one in systems().studies if one.name == name), None)
    if found is None:
        raise UsageError("study", repr(name), f"one of {', '.join(one.name for one in systems().studies)}")
    page = folder / f"{name}.md"
    kept = folder / "runs"
    if page.exists() and not force and not kept.is_dir():
        raise UsageError(str(page), "a file that exists", "a new folder", "-f overwrites it")
    study = _with_inputs(found, inputs)
    if found.outcome is not None:
        study = _resumed(found.outcome(), study, kept, minutes, afresh=force)
    elif minutes is not None:
        kept_ones = [one.name for one in systems().studies if one.outcome is not None]
        raise UsageError("study", f"--minutes with {name}", " or ".join(kept_ones))
    (folder / "tables").mkdir(parents=True, exist_ok=True)
    listen(Event("begin", total=1))
    result = study(runs=runs, seed=seed, progress=lambda text: listen(Event("stage", name, text)))
    for table in result.tables:
        write_text(folder / "tables" / f"{table.name}.csv", csv_text(table))
    write_text(page, result.markdown)
    given = {"--runs": runs, "--seed": seed, "--input": inputs, "--minutes": minutes}
    write_text(folder / EVIDENCE, result.markdown_with(_provenance(name, given)))
    (folder / STUDY_MARK).touch()
    listen(Event("end", name, str(page)))
    return result.markdown


def _provenance(name: str, given: Mapping[str, object]) -> str:
    """Return one line: the command of a study and its options, version, date, machine."""
    from groundstation.pipeline.verbs.provenance import this_machine, utc_told, version_told

    options = [str(word) for option, value in given.items() if value is not None for word in (option, value)]
    command = shlex.join(["groundstation", "study", name, *options, "-o", "DIR"]).replace("`", "'")
    return f"Made by `{command}`; {version_told()}; {utc_told()}; {this_machine()}."


def _with_inputs(study: "Study", inputs: Path | None) -> "Callable[..., StudyResult]":
    """Load a study, with its files where it reads some."""
    if study.reads and inputs is None:
        raise UsageError("study", f"{study.name} without --input", study.reads)
    if inputs is not None and not study.reads:
        reading = " or ".join(one.name for one in systems().studies if one.reads)
        raise UsageError("study", f"--input with {study.name}, which reads no files", reading)
    return study.load() if inputs is None else partial(study.load(), inputs=inputs)


def _resumed(
    outcome: type, study: "Callable[..., StudyResult]", folder: Path, minutes: float | None, *, afresh: bool
) -> "Callable[..., StudyResult]":
    """Return the study with its runs, of type ``outcome``, kept in a folder."""
    from shutil import rmtree

    if afresh and folder.is_dir():
        rmtree(folder)
    kept: KeptRuns[Any] = KeptRuns(folder, outcome)
    return partial(study, kept=kept, minutes=minutes)


class KeptRuns(Generic[R]):
    """Outcomes by name and number in files ``<folder>/<name>.jsonl``, a line each.

    The name is that of their kind: family and seed. The first line has the version that made them; a last line that was
    cut is passed over and made again.
    """

    def __init__(self, folder: Path, outcome: type[R]) -> None:
        self._folder, self._outcome = folder, outcome
        self._runs: dict[str, dict[int, R]] = {}

    def get(self, name: str, number: int) -> R | None:
        """Return the outcome of a run that ended before.

        Raises
        ------
        UsageError
            When another version made the runs: they are not to be mixed.
        """
        if name not in self._runs:
            self._runs[name] = self._load(self._folder / f"{name}.jsonl")
        return self._runs[name].get(number)

    def put(self, name: str, number: int, outcome: R) -> None:
        """Keep the outcome of a run."""
        self._runs.setdefault(name, {})[number] = outcome
        line = json.dumps([number, to_json_exactly(outcome)])
        with (self._folder / f"{name}.jsonl").open("a", encoding="utf-8") as stream:
            stream.write(f"{line}\n")

    def _load(self, path: Path) -> dict[int, R]:
        if not path.is_file():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{json.dumps({'version': __version__})}\n", encoding="utf-8")
            return {}
        head, *lines = path.read_text(encoding="utf-8").split("\n")
        version = json.loads(head)["version"]
        if version != __version__:
            raise UsageError(str(path), f"runs of version {version}", __version__, "a new folder, or -f")
        whole: list[tuple[int, Any]] = [json.loads(line) for line in lines[:-1]]
        if lines[-1]:  # cut: what follows it must not stand on the same line
            path.write_text("\n".join([head, *lines[:-1], ""]), encoding="utf-8")
        return {number: from_json(self._outcome, document) for number, document in whole}
