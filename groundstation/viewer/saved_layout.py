"""Layout saved in the viewer (a blueprint, .rbl), in place of that of a recording.

It binds to an application id, which is another one for each flight: here it gets that of the recording. Timelines and
entity paths are the same for all flights, so that a layout saved from one serves others.
"""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
from rerun.chunk import Chunk, RrdReader

from groundstation.base.errors import GroundstationError, UsageError, told_in_a_line
from groundstation.viewer.file_contents import MAGIC, VIEWPORT, layout_of, rerun_version, version_in
from groundstation.viewer.held_stream import FLUSH_SECONDS
from groundstation.viewer.inner import new_blueprint, send_made
from groundstation.viewer.verification import damaged

SAVE_IT = "in the viewer: menu, Save blueprint"
MOST_BYTES = 50_000_000  # of a layout; one of 50 views has 0.8 MB


def read_layout(path: Path) -> bytes:
    """Return the content of a layout that was saved in the viewer.

    Raises
    ------
    UsageError
        When there is none, it is none of one flight's tabs, or a viewer of another version saved it.
    """
    where = str(path)
    if not path.is_file():
        raise UsageError(where, "no such file", "a blueprint (.rbl)", SAVE_IT)
    with told_in_a_line(where), path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if not content.startswith(MAGIC) or len(content) > MOST_BYTES:
        raise UsageError(where, "no layout", "a blueprint (.rbl)", SAVE_IT)
    saved, here = version_in(content), rerun_version()
    if saved.split(".")[:2] != here.split(".")[:2]:
        raise UsageError(where, f"a layout of Rerun {saved}", f"one of Rerun {here}", f"save it again {SAVE_IT}")
    if fault := damaged([path]).get(path):
        raise UsageError(where, f"damaged: {fault}", "a blueprint (.rbl)", f"save it again {SAVE_IT}")
    reader = RrdReader(path)
    if reader.recordings() or len(reader.blueprints()) != 1:
        raise UsageError(where, "a recording" if reader.recordings() else "no layout", "a blueprint (.rbl)", SAVE_IT)
    with _chunks(content) as chunks:
        if not any(chunk.entity_path == VIEWPORT for chunk in chunks):
            raise UsageError(where, "a blueprint without views", "one of a flight's recording", SAVE_IT)
    return content


def roots_of(path: Path) -> frozenset[str]:
    """Return the first parts of the entity paths that the views of a layout show."""
    paths = (shown for tab in layout_of(path) for _name, listed in tab.views for shown in listed)
    return frozenset(one.lstrip("/").partition("/")[0] for one in paths)


@contextmanager
def _chunks(content: bytes) -> Iterator[Iterator[Chunk]]:
    """Yield the chunks of a layout; Rerun reads files alone."""
    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        path = Path(folder) / "layout.rbl"
        path.write_bytes(content)
        reader = RrdReader(path)
        yield iter(reader.stream(store=reader.blueprints()[0]))


def send_layout_content(stream: rr.RecordingStream, content: bytes) -> None:
    """Send a saved layout to a stream, as that of its recording."""
    with _chunks(content) as chunks, new_blueprint(stream) as made:
        made.send_chunks(chunks)
        send_made(stream, made)


def write_with_layout(recording: Path, content: bytes, target: Path) -> None:
    """Write a copy of a recording with a saved layout in place of its own.

    Raises
    ------
    GroundstationError
        When it cannot be written.
    """
    reader = RrdReader(recording)
    store = reader.recordings()[0]
    try:
        with rr.RecordingStream(store.application_id, recording_id=store.recording_id, send_properties=False) as stream:
            stream.save(target)
            send_layout_content(stream, content)
            stream.flush(timeout_sec=FLUSH_SECONDS)
            stream.send_chunks(reader.stream(store=store))
            stream.flush(timeout_sec=FLUSH_SECONDS)
            stream.disconnect()
    except (OSError, RuntimeError, ValueError) as error:
        raise GroundstationError(str(target), str(error), next_step="check the free space") from error
