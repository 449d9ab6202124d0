"""Run `groundstation` and write where its processor time goes: ``python benchmarks/sampler.py FILE verb ...``.

Every two milliseconds of processor time the main thread's own time since the last look goes to the room at work: the
innermost frame that belongs to one, or to imports where Python is importing. Only Python's own modules are imported
before. FILE is JSON: seconds by room, ``_threads`` those of other threads.
"""

import json
import signal
import sys
import time
from pathlib import Path
from types import FrameType

EVERY_S = 0.002
IMPORTING = "<frozen importlib"
PACKAGE = "/groundstation/"
PASSED = ("base", "__init__.py", "__main__.py", "cli", "pipeline")  # they work for the room that called, or call
spent: dict[str, float] = {}
last_s = 0.0


def room_of(frame: FrameType | None) -> str:
    """Return the room that a frame works for."""
    found = ""
    while frame is not None:
        path = frame.f_code.co_filename
        if path.startswith(IMPORTING):
            return "imports"
        if not found and PACKAGE in path:
            room, *_rest = path.rpartition(PACKAGE)[2].split("/")
            found = "" if room in PASSED else room
        frame = frame.f_back
    return found or "pipeline"


def look(_signal: int, frame: FrameType | None) -> None:
    """Give the time since the last look to the room at work."""
    global last_s
    now_s = time.thread_time()
    room = room_of(frame)
    spent[room] = spent.get(room, 0.0) + now_s - last_s
    last_s = now_s


def main() -> None:
    """Run the verb, and write the seconds."""
    global last_s
    target = Path(sys.argv[1])
    last_s = time.thread_time()
    sys.argv[1:] = sys.argv[2:]
    signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, EVERY_S, EVERY_S)
    try:
        from groundstation.cli.main import main as run

        run()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        spent["_threads"] = time.process_time() - time.thread_time()
        target.write_text(json.dumps(spent), encoding="utf-8")


if __name__ == "__main__":
    main()
