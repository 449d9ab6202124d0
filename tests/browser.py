"""Pages as a browser shows them: headless Chromium, spoken to by its debugging pipe (Chrome DevTools Protocol)."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from select import select
from tempfile import TemporaryDirectory
from typing import Any

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
ANSWER_S = 60.0
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-pipe"),
)

# The browser reads what it is asked at 3 and answers at 4.
LAUNCH = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
for place, end in enumerate(ends, 3):
    os.dup2(end, place)
os.execv(sys.argv[3], sys.argv[3:])
"""


class BrowserError(Exception):
    """The browser ended, refused what it was asked, or does not answer."""


class Browser:
    """A running browser with one page at a time."""

    def __init__(self, writing: int, reading: int) -> None:
        self._writing, self._reading = writing, reading
        self._last, self._rest = 0, b""
        self.told: list[dict[str, Any]] = []  # events since the page was opened
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Ask something of the page."""
        return self._ask(method, self._session, **parameters)

    def open(self, page: Path, width: int = 1200, height: int = 900, *, scripts: bool = True) -> None:
        """Open a page in a window of some size and wait until it is loaded."""
        self.ask("Emulation.setScriptExecutionDisabled", value=not scripts)
        self.ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600
        )
        self.told.clear()
        self.ask("Page.navigate", url=page.absolute().as_uri())
        while not any(event["method"] == "Page.loadEventFired" for event in self.told):
            self._note(self._message())

    def run(self, script: str) -> Any:
        """Run a script in the page, a promise to its end; returns what JSON holds of its value."""
        done = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in done:
            raise BrowserError(json.dumps(done["exceptionDetails"])[:500])
        return done["result"].get("value")

    def complaints(self) -> list[str]:
        """Errors and warnings since the page was opened, and whatever it asked of the network."""
        self.run("0")  # everything told before has arrived then
        found = []
        for event in self.told:
            method, told = event["method"], event["params"]
            if method == "Runtime.exceptionThrown":
                found.append(json.dumps(told["exceptionDetails"])[:300])
            elif method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning", "assert"):
                found.append(json.dumps(told["args"])[:300])
            elif method == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
                found.append(told["entry"]["text"])
            elif method == "Network.requestWillBeSent" and not told["request"]["url"].startswith(("file:", "data:")):
                found.append(f"asks for {told['request']['url']}")
        return found

    def _ask(self, method: str, session: str = "", **parameters: Any) -> dict[str, Any]:
        self._last += 1
        number, message = self._last, {"id": self._last, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self._writing, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message()
            if answer.get("id") == number:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']['message']}")
                return dict(answer["result"])
            self._note(answer)

    def _note(self, message: Mapping[str, Any]) -> None:
        if "method" in message:
            self.told.append({"method": message["method"], "params": message.get("params", {})})

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            if not select([self._reading], [], [], ANSWER_S)[0]:
                raise BrowserError(f"no answer in {ANSWER_S:g} s")
            more = os.read(self._reading, 1 << 16)
            if not more:
                raise BrowserError("the browser ended")
            self._rest += more
        one, _, self._rest = self._rest.partition(b"\0")
        return dict(json.loads(one))


@contextmanager
def browser() -> Iterator[Browser]:
    """Start a browser for a while.

    Raises
    ------
    BrowserError
        When there is none, or it does not start.
    """
    if PROGRAM is None:
        raise BrowserError("no Chromium (Debian: chromium)")
    (its_in, ours_out), (ours_in, its_out) = os.pipe(), os.pipe()
    with TemporaryDirectory(prefix="groundstation-browser-", ignore_cleanup_errors=True) as folder:
        process = subprocess.Popen(
            [sys.executable, "-c", LAUNCH, str(its_in), str(its_out), PROGRAM, *QUIET, f"--user-data-dir={folder}"],
            pass_fds=(its_in, its_out),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            os.close(its_in)
            os.close(its_out)
            yield Browser(ours_out, ours_in)
        finally:
            process.terminate()
            with suppress(subprocess.TimeoutExpired):
                process.wait(10.0)
            process.kill()
            os.close(ours_out)
            os.close(ours_in)
