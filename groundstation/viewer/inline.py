"""Recording inside a notebook, in the viewer of the package rerun-notebook."""

import contextlib
import importlib.util
import io
import os
import sys
from typing import Any

from groundstation.base.errors import GroundstationError
from groundstation.results.flight import FlightResults
from groundstation.systems.system import Systems
from groundstation.tables.table import Flight
from groundstation.viewer.inner import NOTEBOOK, NOTEBOOK_ASSET, NOTEBOOK_ASSET_HERE


def is_notebook() -> bool:
    """Tell whether this process is the kernel of a Jupyter notebook."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


def inline_viewer(
    flight: Flight, results: FlightResults, systems: Systems, *, width: int | str, height: int | str
) -> Any:
    """Return a viewer for a notebook cell with the recording of one flight.

    The recording is logged as into a file. The viewer's own files come from this machine, not from the Internet, unless
    the environment (``NOTEBOOK_ASSET``) says otherwise.

    Parameters
    ----------
    flight, results, systems
        As for :func:`write_recording`.
    width, height : int or "auto"
        Pixels.

    Returns
    -------
    rerun.notebook.Viewer
        What a cell ends with is shown.

    Raises
    ------
    GroundstationError
        When rerun-notebook is not installed, or Rerun refused the data.
    """
    if importlib.util.find_spec(NOTEBOOK) is None:
        raise GroundstationError(
            "the recording in a notebook",
            "rerun-notebook is not installed",
            next_step="pip install 'groundstation[notebook]', or show(inline=False) for a window",
        )
    os.environ.setdefault(NOTEBOOK_ASSET, NOTEBOOK_ASSET_HERE)
    with contextlib.redirect_stdout(io.StringIO()):  # it prints its address, which a notebook does not need
        from rerun.notebook import Viewer

    from groundstation.viewer.recording import open_stream, send_flight

    with open_stream(results.flight_id) as stream:
        try:
            viewer = Viewer(width=width, height=height, recording=stream)  # type: ignore[arg-type]
            send_flight(stream, flight, results, systems)
        except (ValueError, RuntimeError) as error:
            raise GroundstationError("the recording in a notebook", str(error)) from error
    return viewer
