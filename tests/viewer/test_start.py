"""A viewer that does not start skips its tests with the reason, or fails them where it has to start."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from rerun.experimental import ViewerClient

from tests import viewer_shots

DYING = """
import socket, sys
listener = socket.create_server(("127.0.0.1", int(sys.argv[1])))
for _ in range(3):
    listener.accept()[0].close()
sys.exit("thread 'main' panicked at 'no driver'\\nReport bugs: nowhere")
"""  # listens like a viewer without a Vulkan driver, then dies


@pytest.mark.parametrize(
    ("code", "said"), [(DYING, "panicked at 'no driver'"), ("import sys; sys.exit('no such option')", "no such option")]
)
@pytest.mark.parametrize(
    ("ci", "outcome"), [("", pytest.skip.Exception), ("true", pytest.fail.Exception)], ids=["anywhere", "in CI"]
)
def test_a_viewer_that_dies_at_its_start_did_not_start(
    headless_viewer: Callable[[Path], ViewerClient],
    monkeypatch: pytest.MonkeyPatch,
    code: str,
    said: str,
    ci: str,
    outcome: type[BaseException],
) -> None:
    monkeypatch.setenv("CI", ci)
    monkeypatch.setattr(viewer_shots, "viewer_command", lambda *_, port, **__: [sys.executable, "-c", code, str(port)])
    with pytest.raises(outcome, match=said):
        headless_viewer(Path("none.rrd"))
