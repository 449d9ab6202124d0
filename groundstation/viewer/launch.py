"""Viewer of the rerun-sdk wheel, native or in a browser, for a recording."""

import os
import socket
import subprocess
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path

from groundstation.base.errors import GroundstationError
from groundstation.viewer.inner import viewer_executable
from groundstation.viewer.own_name import LOCAL

WEB_PORT = 9090


def require_display(environment: Mapping[str, str], platform: str = sys.platform) -> None:
    """Refuse to open a window where nothing can show it.

    Raises
    ------
    GroundstationError
        When this is a Linux machine without X11 and Wayland.

    Examples
    --------
    >>> require_display({}, "linux")
    Traceback (most recent call last):
    groundstation.base.errors.GroundstationError: view: no display on this machine: --web shows it in a browser
    """
    if platform == "linux" and not (environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY")):
        raise GroundstationError("view", "no display on this machine", next_step="--web shows it in a browser")


def viewer_command(
    what: Path | str, *, web: bool = False, host: str = LOCAL, port: int | None = None, headless: bool = False
) -> list[str]:
    """Return the command line that opens a recording, or the address of a catalog.

    Examples
    --------
    >>> viewer_command(Path("a.rrd"), web=True, port=9091)[1:]
    ['a.rrd', '--bind', '127.0.0.1', '--port', 'auto', '--web-viewer', '--web-viewer-port', '9091']
    """
    command = [str(viewer_executable()), str(what), "--bind", host]
    if web:
        # headless: serve the pages, let the user open the address in a browser of his own
        command += ["--port", "auto", "--serve-web" if headless else "--web-viewer"]
        return [*command, "--web-viewer-port", str(_web_port(host) if port is None else port)]
    command += ["--port", "auto" if port is None else str(port)]
    return [*command, "--headless"] if headless else command


def viewer_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of the viewer, with logging on: the log has the page's address.

    Examples
    --------
    >>> viewer_environment({"HOME": "/home/a", "RUST_LOG": "off"})
    {'HOME': '/home/a'}
    """
    return {name: value for name, value in environment.items() if (name, value) != ("RUST_LOG", "off")}


def _web_port(host: str) -> int:
    """Return Rerun's usual port for the page, or any free one when another viewer has it."""
    try:
        with socket.socket() as listener:
            listener.bind((host, WEB_PORT))
            return WEB_PORT
    except OSError:
        return 0


def open_viewer(
    what: Path | str,
    *,
    web: bool = False,
    host: str = LOCAL,
    port: int | None = None,
    headless: bool = False,
    links: Path | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> int:
    """Open a recording, or the address of a catalog, and wait until the viewer is closed.

    Ctrl-C closes it.

    Parameters
    ----------
    what : Path or str
        An .rrd file (or an .mcap, which Rerun decodes), or the address of a catalog.
    web : bool
        Serve the web viewer and open it in a browser instead of a window.
    host : str
        Address to listen on; only this machine unless said otherwise.
    port : int, optional
        Port of the web page, or of the native viewer's listener; left out, the page has 9090 where that is free and
        everything else any free one.
    headless : bool
        No window; with ``web``: no browser is opened.
    links : Path, optional
        Folder where the links of fleet.rrd begin; left out: that of the recording.
    say : callable
        Takes the address of the page of a recording.

    Returns
    -------
    int
        Exit code of the viewer.

    Raises
    ------
    GroundstationError
        When there is no such file, no viewer, or the page cannot be served.
    """
    folder = None
    if isinstance(what, Path):
        if not what.is_file():
            raise GroundstationError(str(what), "no such file", next_step="run the log first")
        what = what.absolute()
        folder = links or what.parent
        if web:
            return _open_page(what, host, port, headless=headless, say=say)
    command = viewer_command(what, web=web, host=host, port=port, headless=headless)
    try:
        return subprocess.run(command, check=False, env=viewer_environment(os.environ), cwd=folder).returncode
    except KeyboardInterrupt:
        return 0


def _open_page(recording: Path, host: str, port: int | None, *, headless: bool, say: Callable[[str], None]) -> int:
    """Serve the page with a recording until Ctrl-C."""
    from groundstation.viewer.own_page import page_files, page_server

    port = _web_port(host) if port is None else port
    try:
        files = page_files(viewer_executable(), viewer_environment(os.environ))
        with page_server(recording, files, host=host, port=port) as server:
            say(f"{server.url}\nCtrl-C ends")
            if not headless:
                webbrowser.open(server.url)
            threading.Event().wait()
    except KeyboardInterrupt:
        pass
    return 0
