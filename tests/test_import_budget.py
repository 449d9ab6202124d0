"""What each verb loads: modules that it does not need cost every user their time. No time is measured here."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.cli.main import app
from groundstation.systems import OURS
from tests.architecture_picture import import_nodes
from tests.readers.dataflash_writer import flight_log
from tests.readers.receiver_writer import nmea_log
from tests.readers.telemetry_writer import telemetry
from tests.readers.ulog_writer import small_flight

SAMPLE = Path(__file__).parents[1] / "sample_logs" / "taxi-short.csv"
NOT_NEEDED = (  # to look at a log, check or convert it
    *("numba", "scipy", "pandas", "matplotlib", "jinja2", "typst", "rerun", "h5py", "distributed"),
    *("groundstation.systems.system", "groundstation.tables.phases", "groundstation.reports", "groundstation.viewer"),
    *("groundstation.simulation", "groundstation.chapters.by_answer", "groundstation.pipeline.many_flights.runs.batch"),
)
OF_OTHER_LOGS = (  # a table of no profile is read, and its weather and earlier runs are not asked for
    *("groundstation.readers.bags.bag", "groundstation.readers.profile", "groundstation.readers.rtklib_rows"),
    *("groundstation.readers.receiver.host_text", "groundstation.base.metar"),
)
FOR_OTHER_PLACES = ("importlib.metadata", "email", "html", "concurrent.futures", "multiprocessing")
BY_VERB = """
import os, sys
from groundstation.cli.main import main
sys.argv[1:] = {arguments!r}
try: main()
except SystemExit as stop: assert not stop.code, stop.code
"""
BY_OPEN = "import sys, groundstation\ngroundstation.open({arguments[0]!r})\n"
TELL = "print('LOADED', *[name for name in {names!r} if name in sys.modules])"


def loaded(program: str, *arguments: str, names: tuple[str, ...] = NOT_NEEDED) -> list[str]:
    """Which of the names a new process has loaded when it has done its work."""
    code = program.format(arguments=list(arguments)) + TELL.format(names=names)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("COV_", "NUMBA_DISABLE"))}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-1].split()[1:]


@pytest.mark.parametrize("verb", ["info", "check", "convert"])
def test_a_table_is_read_without_what_it_does_not_need(verb: str, tmp_path: Path) -> None:
    target = ["-o", str(tmp_path / "out.mcap")] if verb == "convert" else []
    names = (*NOT_NEEDED, *OF_OTHER_LOGS, "pyarrow.compute", "cattrs", "importlib.metadata", "html", "email")
    assert loaded(BY_VERB, verb, str(SAMPLE), *target, names=names) == []


@pytest.mark.parametrize("words", [("profile", "list"), ("runways", "show", "ENGM")])
def test_a_verb_of_a_group_is_called_without_pydantic(words: tuple[str, ...]) -> None:
    assert loaded(BY_VERB, *words, names=("pydantic", "rich", "importlib.metadata", "scipy", "numba")) == []


def test_what_applies_to_a_log_is_told_without_an_mcap_of_it() -> None:
    CliRunner().invoke(app, ["list", str(SAMPLE)])  # compiles, where that was not done before
    names = ("groundstation.store.writer", "cattrs", "html")
    assert loaded(BY_VERB, "list", str(SAMPLE), names=names) == []


def test_a_purpose_is_answered_without_estimating() -> None:
    asked = ["check", str(SAMPLE), "--for", "heading"]
    CliRunner().invoke(app, asked)  # compiles, where that was not done before
    used = ("groundstation.systems.system", "groundstation.tables.phases")
    not_needed = tuple(name for name in NOT_NEEDED if name not in used)
    others = tuple(path.removesuffix(".system") for path in OURS if ".heading." not in path)
    names = (*not_needed, *others, *FOR_OTHER_PLACES, "groundstation.systems.heading.solution", "cattrs")
    assert loaded(BY_VERB, *asked, names=names) == []


def test_a_trajectory_without_an_imu_is_refused_without_scipy() -> None:
    refused = BY_VERB.replace("not stop.code", "stop.code == 4")
    assert loaded(refused, "check", str(SAMPLE), "--for", "trajectory", names=("scipy", "cattrs")) == []


def test_a_log_is_opened_without_what_it_does_not_need() -> None:
    assert loaded(BY_OPEN, str(SAMPLE), names=(*NOT_NEEDED, "pyarrow.csv", "typer")) == []


@pytest.mark.parametrize("suffix", ["ulg", "BIN", "tlog", "nmea"])
def test_compiled_loops_are_found_again_without_their_compiler(suffix: str, tmp_path: Path) -> None:
    log = tmp_path / f"flight.{suffix}"
    made = {"ulg": lambda: small_flight().data, "BIN": lambda: flight_log().content, "tlog": lambda: telemetry().data}
    made |= {"nmea": nmea_log}
    log.write_bytes(made[suffix]())
    convert = ["convert", str(log), "-q", "--force", "-o", str(tmp_path / "out.mcap")]
    assert CliRunner().invoke(app, convert).exit_code == 0  # compiles, where that was not done before
    of_tables = ("groundstation.readers.csv_profile", "groundstation.readers.flat_csv", "groundstation.readers.profile")
    of_ulog = (*of_tables, "numpy.ma")
    not_needed = (*NOT_NEEDED, "pyarrow", "importlib.metadata", *{"ulg": of_ulog, "BIN": of_tables}.get(suffix, ()))
    assert loaded(BY_VERB, *convert, names=not_needed) == []


BY_RATES = """
import sys
import numpy as np
from groundstation.methods.kalman.rates import Rates
rates = Rates(2, np.array([0]), np.array([1]))
rates.transition(np.ones((3, 1)), np.ones(3), np.ones(2))
rates.carried(np.ones((4, 1)), np.zeros((3, 4), int), 1.0, 2, np.ones((3, 2)))
"""


def test_transitions_by_rates_are_found_again_without_their_compiler() -> None:
    loaded(BY_RATES)  # compiles, where that was not done before
    assert loaded(BY_RATES, names=("numba", "scipy")) == []


@pytest.mark.parametrize("verb", ["run", "report"])
def test_a_run_and_its_report_do_without_pandas(verb: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run = ["run", str(SAMPLE), "-o", str(out), "-q", "-j", "1", "--no-pdf"]
    assert CliRunner().invoke(app, run).exit_code == 0  # compiles, where that was not done before
    again = {"run": [*run, "--redo"], "report": ["report", str(out), "-q"]}[verb]
    names = ("pandas", "numba", "scipy.linalg", "scipy.optimize", "pydantic", "urllib.request")
    assert loaded(BY_VERB, *again, names=names) == []


def test_pandas_is_found_by_everybody_but_pyarrow_in_its_first_look() -> None:
    program = """
import sys, pyarrow as pa
from importlib.util import find_spec
from groundstation.base.without_pandas import spare_pandas
spare_pandas()
assert find_spec("pandas") is not None
pa.array(["text"]), pa.scalar(3.0)
assert "pandas" not in sys.modules
import ppigrf
assert "pandas" in sys.modules
assert pa.table(dict(x=[3.0])).to_pandas()["x"].sum() == 3.0
"""
    assert loaded(program, names=("pandas",)) == ["pandas"]


def test_a_reader_of_others_finds_pandas(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "other-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1.0\n")
    (folder / "entry_points.txt").write_text("[groundstation.readers]\nother = other\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    program = """
import sys, pyarrow
from groundstation.base.without_pandas import spare_pandas
spare_pandas()
pyarrow.array([1])
"""
    assert loaded(program, names=("pandas",)) == ["pandas"]


@pytest.mark.parametrize(("asked", "threads"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_linear_algebra_has_one_thread_before_numpy_is_loaded(asked: dict[str, str], threads: str) -> None:
    code = "import groundstation.cli, os, sys; print('numpy' in sys.modules, os.environ['OPENBLAS_NUM_THREADS'])"
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")} | asked
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.split() == ["False", threads]


def test_a_flight_is_estimated_without_scipy_signal() -> None:
    """It takes longer to import than the rest of scipy together; simulation and studies may have it."""
    package = Path(__file__).parents[1] / "groundstation"
    files = [path for room in ("systems", "methods", "tables") for path in (package / room).rglob("*.py")]
    estimating = [path for path in files if "study" not in str(path.relative_to(package))]
    assert len(estimating) > 100
    slow = {"scipy.signal", "scipy.stats"}
    assert [path.name for path in estimating if slow & imports_of(path)] == []


def imports_of(path: Path) -> set[str]:
    """Return the modules that a file imports, inside functions too."""
    plain = {name.name for node in import_nodes(path) if isinstance(node, ast.Import) for name in node.names}
    return plain | {node.module or "" for node in import_nodes(path) if isinstance(node, ast.ImportFrom)}
