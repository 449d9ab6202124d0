"""A process of the command line ends with its exit code, its output and all that was asked for at its end."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import sys
{before}
from groundstation.base.end_of_process import ending_at_once
class Late:
    def __del__(self): print("taken apart")
late = Late()
with ending_at_once():
    import atexit, threading, time
    atexit.register(print, "asked")
    threading.Thread(target=lambda: (time.sleep(0.2), print("thread"))).start()
    print("said", end="")
    sys.stderr.write("error")
    {end}
"""


ORDINARY = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED" and name[:4] != "COV_"}


def ended(end: str, before: str = "") -> tuple[int, str, str]:
    command = [sys.executable, "-c", CODE.format(end=end, before=before)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=ORDINARY)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(("end", "code"), [("sys.exit()", 0), ("sys.exit(3)", 3), ("raise SystemExit(130)", 130)])
def test_threads_and_wishes_are_done_and_nothing_is_taken_apart(end: str, code: int) -> None:
    assert ended(end) == (code, "saidthread\nasked\n", "error")


def test_another_end_is_left_to_python() -> None:
    assert ended("pass") == (0, "saidthread\nasked\ntaken apart\n", "error")
    assert ended("sys.exit('words')") == (1, "saidthread\nasked\ntaken apart\n", "errorwords\n")
    code, said, error = ended("1 / 0")
    assert (code, said) == (1, "saidthread\nasked\ntaken apart\n")
    assert "ZeroDivisionError" in error


def test_who_asked_before_is_not_left_out() -> None:
    code, said, _ = ended("sys.exit(4)", before="import atexit; atexit.register(print, 'measured')")
    assert (code, said) == (4, "saidthread\nasked\nmeasured\ntaken apart\n")


def test_a_reader_that_went_away_is_told_as_ever() -> None:
    code = """
import sys
from groundstation.base.end_of_process import ending_at_once
with ending_at_once():
    print("said")
    sys.exit(0)
"""
    told = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code], stdout=told, stderr=told, env=ORDINARY) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        error = process.stderr.read()
    assert process.returncode == 120
    assert b"BrokenPipeError" in error


@pytest.mark.parametrize(("words", "code"), [(["--version"], 0), (["info", "nothing.csv"], 2), ([], 2)])
def test_the_command_ends_so(words: list[str], code: int, tmp_path: Path) -> None:
    command = [sys.executable, "-X", "importtime", "-m", "groundstation", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == code
    assert done.stdout or "error" in done.stderr
