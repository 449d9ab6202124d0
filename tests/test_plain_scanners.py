"""Plain Python and machine code find the same in damaged logs: small ones are read by either."""

import copy
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.compile import Loop
from groundstation.base.errors import GroundstationError
from groundstation.readers.registry import read
from tests.fuzz.bases import chapter10_starts, dataflash, starts_with, ulog, ulog_starts
from tests.fuzz.mutation import Mutant, random_edits
from tests.readers.chapter10_packets import messages_1553, packet, time_of_day, word_429, words_429

SEEDS = 10
LOOPS = {"ulog": {"scan"}, "dataflash": {"scan"}, "chapter10": {"scan", "messages_1553", "words_429"}}


def chapter10() -> bytes:
    """Time, 1553 and ARINC 429 of four seconds, with every kind of checksum."""
    parts = []
    for tick in range(40):
        rtc, kind = 10_000_000 + 1_000_000 * tick, {"sequence": tick, "checksum": tick % 4}
        if tick % 10 == 0:
            parts.append(packet(1, 0x11, time_of_day(101, tick / 10), rtc, **kind))
        words = [0x0C21, *range(tick, tick + 12)]
        parts.append(packet(2, 0x19, messages_1553([(rtc, 0, words), (rtc + 500, 0x4000, words[:5])]), rtc, **kind))
        spoken = [(bus, 30, word_429(0o310 + bus, tick)) for bus in range(4)]
        parts.append(packet(3, 0x38, words_429(spoken), rtc + 9, **kind))
    return b"".join(parts)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("name", "write", "starts"),
    [
        ("ulog", ulog, ulog_starts),
        ("dataflash", dataflash, starts_with(b"\xa3\x95")),
        ("chapter10", chapter10, chapter10_starts),
    ],
)
def test_plain_python_finds_what_machine_code_finds(
    name: str, write: Callable[[], bytes], starts: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, compared, run = write(), Counter[str](), Loop.__call__
    fields = list(starts(data))

    def run_both(loop: Loop, *arguments: Any) -> Any:
        again = copy.deepcopy(arguments)
        answer = run(loop, *arguments)
        if loop._small_bytes:
            plain = loop._run_plain(again)
            assert (type(plain), plain) == (type(answer), answer)
            for one, other in zip(arguments, again, strict=True):
                assert one.tobytes() == other.tobytes() if isinstance(one, np.ndarray) else one == other
            compared[loop.py_func.__name__] += 1
        return answer

    monkeypatch.setattr(Loop, "__call__", run_both)
    path = tmp_path / "log"
    for seed in range(SEEDS):
        edits = random_edits(len(data), len(data), fields, np.random.default_rng(seed)) if seed else []
        path.write_bytes(Mutant(data, data[::-1], edits).content)
        try:
            rows = sum(1 for _ in read(path))
        except GroundstationError:
            assert seed
        else:
            assert rows
    assert set(compared) >= LOOPS[name] and compared["scan"] > SEEDS / 2
