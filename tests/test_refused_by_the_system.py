"""What the operating system refuses (a disk, memory, rights) is one line that says what and where."""

import errno
import io
import os
import stat
import sys
from pathlib import Path
from typing import Any, NoReturn

import pytest
from typer.testing import CliRunner

from groundstation.base import reading
from groundstation.base.errors import GroundstationError, lack_of_memory, told_in_a_line
from groundstation.base.reading import open_to_read
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight import outcome
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from tests.readers.bag_writer import small_flight, write_ros1

SAMPLE = Path(__file__).parents[1] / "sample_logs" / "taxi-short.csv"
BROKEN_AT = 3000  # byte from which a disk gives nothing


def groundstation(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, result.stderr


@pytest.fixture
def broken_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every file that is opened to be read gives an error behind its first bytes, which does not name it."""

    class Broken(io.FileIO):
        def readinto(self, buffer: Any, /) -> int:
            if self.tell() >= BROKEN_AT:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            return super().readinto(memoryview(buffer)[: BROKEN_AT - self.tell()])

        def readall(self) -> bytes:
            raise OSError(errno.EIO, os.strerror(errno.EIO))

    named = type("Named", (reading._NamedFile, Broken), {})
    monkeypatch.setattr(reading, "_NamedFile", named)


VERBS = ("info", "check", "convert -f -o {0}/o.mcap", "run -f -j 1 -o {0}/out", "clip -f -o {0}/c.mcap", "list")


@pytest.mark.parametrize("verb", [*VERBS, "export -f -o {0}/e.csv"])
@pytest.mark.parametrize("name", ["flight.csv", "flight.bag"])
def test_a_log_on_a_broken_disk_is_named(verb: str, name: str, tmp_path: Path, broken_disk: None) -> None:
    log = tmp_path / name
    if name.endswith("csv"):
        log.write_bytes(SAMPLE.read_bytes())
    else:
        write_ros1(log, small_flight(is_ros1=True))
    code, told = groundstation(*verb.format(tmp_path).split(), str(log))
    (line,) = told.strip().splitlines()
    assert code == 1
    assert line.startswith("error: ") and line.endswith(f"{name}: Input/output error"), line


@pytest.mark.skipif(sys.platform != "linux", reason="a file that can be opened and not be read")
def test_a_read_that_fails_names_the_file() -> None:
    path = Path("/proc/self/mem")
    for size in (10, -1):
        with open_to_read(path) as file, pytest.raises(OSError, match="error") as found:
            file.read(size)
        assert found.value.filename == str(path) or found.value.filename == path
    with pytest.raises(GroundstationError, match=r"^/proc/self/mem: Input/output error$"), told_in_a_line("elsewhere"):
        open_to_read(path).read()


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (MemoryError("Unable to allocate 7.45 GiB"), "not enough memory"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "not enough memory"),
        (
            ImportError("/usr/lib/libarrow.so.2600: failed to map segment from shared object"),
            "to load libarrow.so.2600",
        ),
        (ImportError("libscipy_openblas-6c.so: cannot allocate memory in static TLS block"), "libscipy_openblas-6c.so"),
        (RuntimeError("can't start new thread"), "no further thread"),
        (ValueError("malloc of size 64 failed"), "not enough memory"),
    ],
)
def test_want_of_memory_is_one_line_and_no_defect(
    error: Exception, told: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def lacks(*_: object, **__: object) -> NoReturn:
        raise error

    assert told in lack_of_memory(error)
    reason, trace = outcome.reason_of("a.csv", error)
    assert reason.startswith("a.csv: ") and told in reason and "internal" not in reason and trace == ""
    monkeypatch.setattr("groundstation.pipeline.verbs.describe.describe", lacks)
    code, line = groundstation("info", str(SAMPLE))
    assert code == 1 and line.startswith("error: ") and told in line and line.count("\n") == 1
    monkeypatch.setattr("groundstation.pipeline.one_flight.flight.analyse", lacks)
    code, line = groundstation("run", str(SAMPLE), "-j", "1", "-o", str(tmp_path / "out"), "--only", "results")
    assert code == 1 and line.startswith("error: taxi-short.csv: ") and told in line.splitlines()[0]


def test_other_errors_are_no_want_of_memory() -> None:
    for error in (
        ImportError("No module named 'x'"),
        OSError(5, "Input/output error"),
        ValueError("memory of a goldfish"),
    ):
        assert lack_of_memory(error) == ""


@pytest.mark.skipif(sys.platform == "win32", reason="rights of folders are those of POSIX")
@pytest.mark.parametrize(("mask", "rights"), [(0o077, 0o700), (0o002, 0o775), (0o022, 0o755)])
def test_folders_and_files_have_the_rights_that_the_mask_leaves(mask: int, rights: int, tmp_path: Path) -> None:
    log = tmp_path / "a.csv"
    log.write_text("time_s,baro.pressure_altitude_m\n0,1\n1,2\n2,3\n", encoding="utf-8")
    before = os.umask(mask)
    try:
        (done,) = run_many([log], tmp_path / "out", Configuration(), jobs=1, with_pdf=False, only_results=True)
        convert_log(open_log(log), tmp_path / "a.mcap")
    finally:
        os.umask(before)
    folder = Path(done.folder)
    every = [tmp_path / "out", folder, *folder.rglob("*"), tmp_path / "a.mcap"]
    for path in every:
        wanted = rights if path.is_dir() else rights & 0o666
        assert stat.S_IMODE(path.stat().st_mode) == wanted, path
