"""Fixtures of the whole suite: the headless viewer and browser, runs made once."""

import os

# Before numpy comes: threads that wait for small matrices take a third of the processor time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hashlib
import pickle
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from filelock import FileLock
from rerun.experimental import ViewerClient

from groundstation.base import compile as compiling
from groundstation.base.garbage import importing
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.readers import profile_sources, registry
from tests.browser import Browser, BrowserError, browser
from tests.viewer_shots import NoViewerError, viewer

SAMPLES = Path(__file__).parents[1] / "sample_logs"
compiling.PLAIN_S = (
    0.0  # loops are tested as they are compiled; test_plain_scanners tells that plain Python does the same
)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without a search for garbage, and leave what stands for thousands of tests to no later one."""
    with importing():
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path) -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
    """Leave out the search for examples in files that have none: in 2000 files it took 3 s of each worker."""
    found = yield
    if file_path.suffix == ".py" and ">>>" not in file_path.read_text(encoding="utf-8"):
        return [one for one in found if type(one) is pytest.Module]
    return found


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


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """A browser; without one the tests are skipped, but not in CI."""
    try:
        with browser() as started:
            yield started
    except BrowserError as error:
        if os.environ.get("CI") == "true":
            raise
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def finished_run(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Outcome]:
    """Run a sample log with everything a run makes, once for all tests of all workers: copy it before you change it."""
    is_worker = "PYTEST_XDIST_WORKER" in os.environ
    shared = tmp_path_factory.getbasetemp().parent if is_worker else tmp_path_factory.getbasetemp()

    def run(sample: str, configuration: Configuration | None = None) -> Outcome:
        wanted = configuration or Configuration()
        folder = shared / f"finished-{sample}-{hashlib.sha256(repr(wanted).encode()).hexdigest()[:8]}"
        told = folder / "outcome.pickle"
        with FileLock(f"{folder}.lock"):
            if not told.exists():
                (outcome,) = run_many([SAMPLES / f"{sample}.csv"], folder / "out", wanted, jobs=1)
                told.write_bytes(pickle.dumps(outcome))
        return pickle.loads(told.read_bytes())

    return run


@pytest.fixture
def own_profiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The user's folder of profiles, empty."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    folder = tmp_path / "config/groundstation/profiles"
    folder.mkdir(parents=True)
    forget_profiles()
    yield folder
    forget_profiles()


def forget_profiles() -> None:
    """Forget the profiles that were loaded, as a new process does."""
    for cached in (profile_sources._loaded, registry._plug_ins):
        cached.cache_clear()
