"""Where the recorded logs are (GROUNDSTATION_REAL_LOGS); a benchmark that lacks one says so in a line."""

import os
from pathlib import Path

LOGS = Path(os.environ.get("GROUNDSTATION_REAL_LOGS", Path(__file__).parents[2] / "shared" / "data"))


def are_here(*paths: Path) -> bool:
    """Whether all of these logs exist; names the first that does not."""
    missing = next((path for path in paths if not path.exists()), None)
    if missing is not None:
        print(f"no {missing}: left out (GROUNDSTATION_REAL_LOGS)")
    return missing is None
