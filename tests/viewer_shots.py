"""Drive the real viewer without a window: start it, open recordings, visit their tabs, take each view's own picture."""

import io
import os
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from rerun.experimental import View, ViewerClient

from groundstation.viewer.launch import viewer_command

PATIENCE_S = 30.0
WINDOW, SMALL = "1280x800", 400  # pixels; a small picture is enough to see whether anything moves
ALL_OR_SOME = pytest.mark.parametrize(
    "is_every", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["one of a kind", "every view"]
)
SATURATED = 25  # difference of the highest and the lowest colour channel: series and states are colourful, axes are not


class NoViewerError(Exception):
    """The viewer did not start: most likely there is no Vulkan driver."""


def free_port() -> int:
    """A port nobody listens on: a busy one connects to somebody else's viewer without a word."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


@contextmanager
def viewer(recording: Path, home: Path) -> Iterator[ViewerClient]:
    """A headless viewer of our own with a recording open; no analytics, no network, ended on leaving."""
    port = free_port()
    nowhere = "http://127.0.0.1:9"
    environment = os.environ | {"CI": "1", "HOME": str(home), "RUST_LOG": "error"}
    environment |= {
        "HTTPS_PROXY": nowhere,
        "HTTP_PROXY": nowhere,
        "NO_PROXY": "127.0.0.1",
        "XDG_RUNTIME_DIR": str(home),
    }
    process = subprocess.Popen(
        [*viewer_command(recording, headless=True, port=port), "--window-size", WINDOW],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        client = _drawing(port, process)
        if client is None:
            process.terminate()
            raise NoViewerError(_reason(process.communicate(timeout=PATIENCE_S)[1]))
        _until(lambda: _is_loaded(client), recording.name)
        yield client
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)


def _drawing(port: int, process: "subprocess.Popen[str]") -> ViewerClient | None:
    """A client whose viewer drew a picture, or None: without a Vulkan driver it listens, may even answer, then dies."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline and process.poll() is None:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.take_screenshot(max_size=SMALL)
            return client
        except (OSError, RuntimeError):  # not yet listening, still starting, or dying
            time.sleep(0.1)
    return None


def _reason(said: str) -> str:
    """The line of the viewer's last words that says why."""
    lines = said.strip().splitlines() or ["it said nothing"]
    return next((line for line in lines if "panicked" in line), lines[-1])


def _until(is_so: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not is_so():
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what}: not within {PATIENCE_S} s")
        time.sleep(0.1)


def _is_loaded(client: ViewerClient) -> bool:
    try:
        state = client.get_state()
    except RuntimeError:  # still starting
        return False
    return bool(state.recordings and not state.loading and state.recordings[0].timelines and state.views)


def open_recording(client: ViewerClient, path: Path) -> None:
    """Open a recording in place of whatever was open, and wait until it is loaded."""
    client.close("all")
    client.open(str(path))
    _until(lambda: _is_loaded(client), path.name)


def picture(png: bytes) -> np.ndarray:
    """Pixels of a screenshot, shape (height, width, 3)."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(np.int16)


def colourful(pixels: np.ndarray) -> int:
    """Number of pixels that are neither black, grey nor white."""
    return int((pixels.max(axis=2) - pixels.min(axis=2) > SATURATED).sum())


def settled(client: ViewerClient, view_id: str | None = None, max_size: int | None = None) -> bytes:
    """A shot of the window or of one view once two in a row agree: the first ones show an empty grid and toasts."""
    last = client.take_screenshot(view_id, max_size=max_size)
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        now = client.take_screenshot(view_id, max_size=max_size)
        if now == last:
            return now
        last = now
    raise TimeoutError("the picture did not come to rest")


def drawn_in(client: ViewerClient, view_id: str, measure: Callable[[np.ndarray], int], enough: int = -1) -> int:
    """Number of pixels that a view of the page drew; it is shot again until they are more than enough, PATIENCE_S long.

    The first pictures of a page may show an empty grid.
    """
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            drawn = measure(picture(client.take_screenshot(view_id)))
        except ConnectionError:  # the page does not show it yet
            drawn = -1
        if drawn > enough or time.monotonic() > deadline:
            return drawn


def chosen(views: Sequence[View], is_every: bool) -> list[View]:
    """Views of a page to take pictures of: every one, or of each class the first."""
    return list(views) if is_every else list({view.view_class: view for view in reversed(views)}.values())


def pages(client: ViewerClient, at_rest: bool = True) -> Iterator[tuple[str, list[View]]]:
    """Visit every tab, nested ones too: its name and the views it shows, once the picture has come to rest."""
    blueprint = client.get_blueprint().blueprint
    views = {view.view_id.split("/")[-1]: view for view in client.get_state().views}
    root = "container/" + blueprint["/viewport"]["ViewportBlueprint"]["root_container"]
    for name, choices, shown in _ways(blueprint, root):
        for container, tab in choices.items():
            _container(blueprint, container)["active_tab"] = tab
        client.set_blueprint(blueprint, of="recording")
        if at_rest:
            settled(client, max_size=SMALL)
        yield name, [views[path.split("/")[-1]] for path in shown]


def _container(blueprint: dict[str, Any], path: str) -> dict[str, Any]:
    found: dict[str, Any] = blueprint[f"/{path}"]["ContainerBlueprint"]
    return found


def _ways(blueprint: dict[str, Any], path: str) -> Iterator[tuple[str, dict[str, str], list[str]]]:
    """Every choice of tabs that shows something new: its name, the tabs to make active, the views then seen."""
    if path.startswith("view/"):
        yield str(blueprint[f"/{path}"]["ViewBlueprint"].get("display_name", "")), {}, [path]
        return
    container = _container(blueprint, path)
    contents = [container["contents"]] if isinstance(container["contents"], str) else container["contents"]
    name = str(container.get("display_name", ""))
    if container["container_kind"] == "Tabs":
        for tab in contents:
            for inner, choices, shown in _ways(blueprint, tab):
                yield f"{name}/{inner}", {path: tab, **choices}, shown
        return
    parts = [list(_ways(blueprint, part)) for part in contents]
    for turn in range(max(len(part) for part in parts)):
        chosen = [part[min(turn, len(part) - 1)] for part in parts]
        choices = {key: tab for _, picks, _ in chosen for key, tab in picks.items()}
        yield f"{name}#{turn}", choices, [view for _, _, shown in chosen for view in shown]
