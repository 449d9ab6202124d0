"""``view``: which recording stands for a folder, addresses of catalogs, and what is not opened."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.cli.main import app
from groundstation.viewer import launch

FLIGHT = "20260504T060000Z_A12_7"


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of what the viewer was told to open, in place of a viewer."""
    seen: list[str] = []

    def open_viewer(what: Path | str, **_: object) -> int:
        seen.append(what.name if isinstance(what, Path) else what)
        return 0

    monkeypatch.setattr(launch, "open_viewer", open_viewer)
    monkeypatch.setenv("DISPLAY", ":0")
    return seen


def test_without_a_display_one_line_names_the_browser(
    tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(launch.require_display, "__defaults__", ("linux",))
    code, err = view(recordings(tmp_path / "out", "fleet.rrd"))
    assert (code, err) == (1, "error: view: no display on this machine: --web shows it in a browser\n")
    assert CliRunner().invoke(app, ["view", "--web", str(tmp_path / "out")]).exit_code == 0 and opened == ["fleet.rrd"]


def view(what: Path | str) -> tuple[int, str]:
    """Exit code and stderr."""
    result = CliRunner().invoke(app, ["view", str(what)])
    return result.exit_code, result.stderr


def recordings(folder: Path, *names: str) -> Path:
    """A folder with files that begin as recordings do."""
    folder.mkdir()
    for name in names:
        (folder / name).write_bytes(b"RRF2")
    return folder


@pytest.mark.parametrize(
    ("folder", "names", "expected"),
    [
        (FLIGHT, (f"{FLIGHT}.rrd", "part.rrd"), f"{FLIGHT}.rrd"),
        ("renamed", (f"{FLIGHT}.rrd",), f"{FLIGHT}.rrd"),
        ("out", ("fleet.rrd", "part.rrd"), "fleet.rrd"),
        ("compared", ("compare.rrd", "another.rrd"), "compare.rrd"),
    ],
)
def test_a_folder_opens_its_own_recording(
    tmp_path: Path, opened: list[str], folder: str, names: tuple[str, ...], expected: str
) -> None:
    assert view(recordings(tmp_path / folder, *names)) == (0, "")
    assert opened == [expected]


def test_a_folder_without_one_recording_of_its_own_is_one_line(tmp_path: Path, opened: list[str]) -> None:
    for number, names in enumerate(((), ("a.rrd", "b.rrd"))):
        code, err = view(recordings(tmp_path / f"folder{number}", *names))
        assert code == 2 and err.count("\n") == 1 and f"{len(names)} files *.rrd" in err
    assert not opened


def test_the_address_of_a_catalog_is_handed_on_as_it_is(opened: list[str]) -> None:
    assert view("rerun+http://127.0.0.1:51234") == (0, "")
    assert opened == ["rerun+http://127.0.0.1:51234"]


@pytest.mark.parametrize("content", [b"", b"RR", b"no recording"])
def test_a_file_that_is_no_recording_is_not_opened(tmp_path: Path, opened: list[str], content: bytes) -> None:
    (tmp_path / "a.rrd").write_bytes(content)
    code, err = view(tmp_path / "a.rrd")
    assert code == 1 and not opened
    assert err == f"error: {tmp_path / 'a.rrd'}: no Rerun recording: run the log again\n"


def test_a_log_that_cannot_be_run_is_named_once(tmp_path: Path, opened: list[str]) -> None:
    (tmp_path / "a.csv").touch()
    code, err = view(tmp_path / "a.csv")
    assert code == 1 and not opened
    assert err.splitlines()[-1].startswith("error: a.csv: found an empty file")
