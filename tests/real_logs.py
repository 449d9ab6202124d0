"""Where the recorded logs of real aircraft are; a test that needs one skips, saying so, where they are not."""

import os
from pathlib import Path

import pytest

REAL_LOGS = Path(os.environ.get("GROUNDSTATION_REAL_LOGS", Path(__file__).parents[2] / "shared" / "data"))


def real_log(name: str) -> Path:
    """Path of a recorded log, ``g1000/log_220417_125002_LFQA.csv``; skips the test where it is absent."""
    path = REAL_LOGS / name
    if not path.exists():
        pytest.skip(f"recorded log {name} is not here (GROUNDSTATION_REAL_LOGS)")
    return path
