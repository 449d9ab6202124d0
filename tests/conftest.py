"""Fixtures of the whole suite: the headless viewer."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from rerun.experimental import ViewerClient

from tests.viewer_shots import NoViewerError, viewer


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
