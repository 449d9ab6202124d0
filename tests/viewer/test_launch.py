"""Opening a recording: the viewer of the wheel, this machine alone unless said otherwise."""

import subprocess
from pathlib import Path

import pytest

from groundstation.base.errors import GroundstationError
from groundstation.viewer import inner, launch
from groundstation.viewer.inner import viewer_executable
from groundstation.viewer.launch import open_viewer, viewer_command


def test_the_viewer_is_the_one_of_the_wheel() -> None:
    assert viewer_executable().is_file()


@pytest.mark.parametrize("web", [False, True])
def test_listens_on_this_machine_alone(web: bool) -> None:
    command = viewer_command(Path("a.rrd"), web=web)
    assert command[command.index("--bind") + 1] == "127.0.0.1"


def test_web_without_a_browser_serves_only() -> None:
    command = viewer_command(Path("a.rrd"), web=True, host="0.0.0.0", port=9123, headless=True)
    assert "--serve-web" in command and "--web-viewer" not in command
    assert command[command.index("--bind") + 1] == "0.0.0.0" and command[-1] == "9123"


def test_a_missing_recording_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(GroundstationError, match="no such file"):
        open_viewer(tmp_path / "a.rrd")


def test_an_installation_without_viewer_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inner.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(GroundstationError, match="rerun-sdk"):
        viewer_executable()


@pytest.mark.parametrize(("ending", "code"), [(None, 7), (KeyboardInterrupt, 0)])
def test_waits_for_the_viewer_and_hands_on_its_exit_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: type[BaseException] | None, code: int
) -> None:
    def run(command: list[str], check: bool, env: dict[str, str], cwd: Path) -> "subprocess.CompletedProcess[bytes]":
        if ending is not None:
            raise ending
        assert cwd == tmp_path and command[1] == str(tmp_path / "a.rrd")
        return subprocess.CompletedProcess(command, 7)

    (tmp_path / "a.rrd").touch()
    monkeypatch.setattr(launch.subprocess, "run", run)
    assert open_viewer(tmp_path / "a.rrd") == code
