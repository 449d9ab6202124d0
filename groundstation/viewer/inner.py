"""Private parts of Rerun in use, all in this file, each with its reason.

Names, places and messages of its programs. Look through this file, and no other, when ``rerun-sdk`` goes to another
minor version. Rerun is imported inside the functions: opening its viewer does without.
"""

import importlib.util
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from groundstation.base.errors import GroundstationError

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb
    from rerun.catalog import CatalogClient

# What the page of the web viewer asks for.
PAGE_FILES = ("/", "/re_viewer.js", "/re_viewer_bg.wasm", "/favicon.ico", "/sw.js")
LENGTH_HEADER = "rerun-final-length"  # of /re_viewer_bg.wasm: by it the page shows how much has come
_PAGE_ADDRESS = re.compile(r"http://127\.0\.0\.1:(\d+)")
NOTEBOOK = "rerun_notebook"  # the package that rerun.notebook imports: asked for before, to say how it is installed
NOTEBOOK_ASSET = "RERUN_NOTEBOOK_ASSET"  # the environment's word on where the viewer in a cell comes from
NOTEBOOK_ASSET_HERE = "serve-local"  # from this machine; left out, from the Internet
SEGMENT = "rerun_segment_id"  # the column of its name in the table of a catalog
# Further columns of that table, which the catalog itself adds to a recording.
OF_THE_CATALOG = (
    *("rerun_layer_names", "rerun_storage_urls", "rerun_last_updated_at", "rerun_num_chunks", "rerun_size_bytes"),
    *("rerun_registration_status", "rerun_registration_time", "rerun_schema_sha256"),
)


def viewer_executable() -> Path:
    """Return the path of the viewer shipped in the wheel.

    Rerun looks on PATH, where an environment that is not activated has nothing.

    Raises
    ------
    GroundstationError
        When the installation lacks it.
    """
    package = importlib.util.find_spec("rerun_cli")
    folder = Path(package.origin).parent if package is not None and package.origin is not None else Path()
    name = "rerun.exe" if sys.platform == "win32" else "rerun"
    for place in (folder / "Rerun.app" / "Contents" / "MacOS" / "Rerun", folder / name):
        if place.is_file():
            return place
    raise GroundstationError("the Rerun viewer", f"nothing in {folder}", "the executable of rerun-sdk", "reinstall it")


def page_port(line: str) -> int | None:
    """Return the port of the web viewer's page from a line of its log; None for other lines.

    No other place has it.

    Examples
    --------
    >>> page_port("[INFO] Hosting a web-viewer at http://127.0.0.1:9090?url=x"), page_port("listening on :9876")
    (9090, None)
    """
    told = _PAGE_ADDRESS.search(line)
    return int(told[1]) if told and "web-viewer" in line else None


def catalog_client(url: str) -> "CatalogClient":
    """Make a client of a catalog server without loading datafusion (43 MB).

    The public constructor loads it.
    """
    from rerun.catalog import CatalogClient
    from rerun_bindings import CatalogClientInternal

    return CatalogClient._from_internal(CatalogClientInternal(url, None, None))


def send_blueprint(stream: "rr.RecordingStream", blueprint: "rrb.Blueprint") -> None:
    """Send a layout to a stream, and close the stream that the layout is made in."""
    with new_blueprint(stream) as made:
        made.set_time("blueprint", sequence=0)
        blueprint._log_to_stream(made)
        send_made(stream, made)


@contextmanager
def new_blueprint(stream: "rr.RecordingStream") -> "Iterator[rr.RecordingStream]":
    """Yield a stream to make the layout of a recording in, and close it.

    Rerun 0.41 leaves its own open: two threads and their buffers stay for each recording of a process.
    """
    import rerun as rr
    import rerun_bindings

    made = rr.RecordingStream._from_native(
        rerun_bindings.new_blueprint(
            application_id=str(rr.get_application_id(stream)),
            make_default=False,
            make_thread_default=False,
            default_enabled=True,
        )
    )
    try:
        yield made
    finally:
        made.disconnect()


def send_made(stream: "rr.RecordingStream", made: "rr.RecordingStream") -> None:
    """Send a layout that was made: it is that of the recording, and what is shown."""
    import rerun_bindings

    rerun_bindings.send_blueprint(made.memory_recording().storage, True, True, recording=stream.to_native())


def forget_closed() -> None:
    """End the threads and free the buffers of streams that are no longer referenced.

    Without this call they stay.
    """
    import rerun_bindings

    rerun_bindings.flush_and_cleanup_orphaned_recordings()
