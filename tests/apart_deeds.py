"""What processes of single logs do in tests, by the names of their logs; little is loaded for it."""

import ctypes
import gc
import json
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener

ENDLESS_S = 300.0


@dataclass(frozen=True)
class Deed:
    """A log that makes its process do something, in a folder."""

    name: str
    folder: Path

    @property
    def log(self) -> str:
        return str(self.folder / self.name)


def act(job: Deed, listen: Listener) -> Outcome:
    """What a process of these tests does, by the name of its log."""
    listen(Event("stage", job.name, "acting"))
    DEEDS[job.name](job.folder)
    return Outcome(job.log, "done", "a line", times_s={"acting": 1.5})


def take_memory(_out: Path) -> None:
    held = [b"x" * (1 << 27) for _ in range(20)]
    time.sleep(ENDLESS_S)
    del held


def ask_for_memory(_out: Path) -> None:
    ctypes.CDLL(None).malloc.restype = ctypes.c_void_p
    assert ctypes.CDLL(None).malloc(ctypes.c_size_t(1 << 40)) is None
    raise MemoryError


def write_much(out: Path) -> None:
    with (out / "much").open("wb") as file:
        file.write(bytes(2 << 20))


def gain_rights(_out: Path) -> None:
    status = Path("/proc/self/status").read_text()
    assert "NoNewPrivs:\t1" in status


def tell_threshold(out: Path) -> None:
    (out / "threshold").write_text(str(gc.get_threshold()[0]))


def leave_children(out: Path) -> None:
    """Processes in groups and sessions of their own, which nobody waits for."""
    for number in range(3):
        if os.fork() == 0:
            os.setsid()
            if number == 2 and os.fork():
                os._exit(0)
            (out / f"child{number}").write_text(str(os.getpid()))
            time.sleep(ENDLESS_S)
    while len(list(out.glob("child*"))) < 3:
        time.sleep(0.01)


def leave_children_and_hang(out: Path) -> None:
    leave_children(out)
    time.sleep(ENDLESS_S)


DEEDS: dict[str, Callable[[Path], None]] = {
    "threshold": tell_threshold,
    "good": lambda _out: None,
    "hangs": lambda _out: time.sleep(ENDLESS_S),
    "takes_memory": take_memory,
    "asks_for_memory": ask_for_memory,
    "writes_much": write_much,
    "crashes": lambda _out: os.kill(os.getpid(), signal.SIGSEGV),
    "exits": lambda _out: os._exit(0),
    "raises": lambda _out: json.loads("{"),
    "gains_rights": gain_rights,
    "leaves_children": leave_children,
    "leaves_children_and_hangs": leave_children_and_hang,
}
