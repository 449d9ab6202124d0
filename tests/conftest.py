"""Fixtures of the whole suite: the headless viewer, runs made once, reports without their figures."""

import os

# Before numpy comes: threads that wait for small matrices take a third of the processor time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import gc
import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import ExitStack, nullcontext
from contextvars import Context
from pathlib import Path

import pytest
from filelock import FileLock
from rerun.experimental import ViewerClient

from groundstation.base import compile as compiling
from groundstation.pipeline.many_flights.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.reports.drawing import sketching
from tests.blank_figures import blank_figures
from tests.viewer_shots import NoViewerError, viewer

SAMPLES = Path(__file__).parents[1] / "sample_logs"
compiling.PLAIN_S = (
    0.0  # loops are tested as they are compiled; test_plain_scanners tells that plain Python does the same
)


def pytest_collection_finish() -> None:
    """Leave what stands for thousands of tests to no further look of the garbage collector."""
    gc.freeze()


@pytest.fixture(scope="module")
def headless_viewer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[Path], ViewerClient]]:
    """Start the real viewer on a recording, without a window; it ends after the module's last test.

    Where it does not start the test is skipped with the reason; with CI=true, where it has to start, the test fails.
    """
    with ExitStack() as stack:

        def start(recording: Path) -> ViewerClient:
            try:
                return stack.enter_context(viewer(recording, tmp_path_factory.mktemp("home")))
            except NoViewerError as error:
                reason = f"the headless viewer did not start (Debian: mesa-vulkan-drivers, libvulkan1): {error}"
            if os.environ.get("CI") == "true":
                pytest.fail(reason, pytrace=False)
            pytest.skip(reason)

        yield start


@pytest.fixture(scope="session")
def finished_run(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Outcome]:
    """Run a sample log with everything a run makes, once for all tests of all workers: copy it before you change it.

    With ``is_blank`` figures are frames of their size.
    """
    is_worker = "PYTEST_XDIST_WORKER" in os.environ
    shared = tmp_path_factory.getbasetemp().parent if is_worker else tmp_path_factory.getbasetemp()

    def run(sample: str, configuration: Configuration | None = None, *, is_blank: bool = False) -> Outcome:
        wanted = configuration or Configuration()
        folder = shared / f"finished-{sample}-{hashlib.sha256(repr((wanted, is_blank)).encode()).hexdigest()[:8]}"
        told = folder / "outcome.pickle"
        with FileLock(f"{folder}.lock"):
            if not told.exists():
                # a context of its own: a test that leaves its figures unpainted may be the first to ask
                with blank_figures() if is_blank else nullcontext():
                    (outcome,) = Context().run(run_many, [SAMPLES / f"{sample}.csv"], folder / "out", wanted, jobs=1)
                told.write_bytes(pickle.dumps(outcome))
        return pickle.loads(told.read_bytes())

    return run


@pytest.fixture
def unpainted() -> Iterator[None]:
    """Leave the figures of reports unpainted, three quarters of a run's work: for tests that look at no report."""
    with sketching():
        yield
