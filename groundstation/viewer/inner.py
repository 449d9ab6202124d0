"""The names of Rerun that are not public, all in this file; each with the reason for it and what to do without."""

from typing import TYPE_CHECKING

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

if TYPE_CHECKING:
    from rerun.catalog import CatalogClient


def catalog_client(url: str) -> "CatalogClient":
    """Make a client of a catalog server, without the library (datafusion, 43 MB) that the public constructor loads."""
    from rerun.catalog import CatalogClient
    from rerun_bindings import CatalogClientInternal

    return CatalogClient._from_internal(CatalogClientInternal(url, None, None))


def send_blueprint(stream: rr.RecordingStream, blueprint: rrb.Blueprint) -> None:
    """Send a layout to a stream, as its own method does, and close the stream that it is made in.

    Rerun 0.41 leaves that one open: two threads and their buffers stay for each recording of a process.
    """
    made = rr.RecordingStream._from_native(
        rerun_bindings.new_blueprint(
            application_id=str(rr.get_application_id(stream)),
            make_default=False,
            make_thread_default=False,
            default_enabled=True,
        )
    )
    try:
        made.set_time("blueprint", sequence=0)
        blueprint._log_to_stream(made)
        storage = made.memory_recording().storage
        rerun_bindings.send_blueprint(storage, True, True, recording=stream.to_native())
    finally:
        made.disconnect()


def forget_closed() -> None:
    """End the threads and free the buffers of streams that nobody holds any more; without it they stay."""
    rerun_bindings.flush_and_cleanup_orphaned_recordings()
