"""Bounds of a log that is read in a process of its own (``--isolate``).

Table ``[isolation]`` of the settings.
"""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class Isolation:
    """Limits of the process that reads one log; none of them changes a result.

    Parameters
    ----------
    memory_mb : float
        Memory of the process and of those that it starts, 10^6 bytes.
    time_s : float
        Time for one log; ``--timeout`` may give less.
    file_mb : float
        Size of any file that is written, 10^6 bytes.
    """

    memory_mb: float = number(4_000.0, 500.0, 10_000_000.0)
    time_s: float = number(3_600.0, 1.0, 1_000_000.0)
    file_mb: float = number(8_000.0, 1.0, 10_000_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)
