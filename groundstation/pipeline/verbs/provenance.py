"""Provenance of published figures: machine, version and commit of the checkout, date."""

import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.halves import cores
from groundstation.base.version import __version__

CHECKOUT = Path(__file__).resolve().parents[3]
CPU_FACTS = Path("/proc/cpuinfo")
BYTES_PER_GB = 1e9


@dataclass(frozen=True)
class Machine:
    """The machine that measured, its cores those of this process."""

    cpu: str
    cores: int
    memory_gb: float
    python: str

    def __str__(self) -> str:
        """Return the machine as one phrase."""
        return f"{self.cpu}, {self.cores} cores, {self.memory_gb:g} GB, Python {self.python}"


def this_machine() -> Machine:
    """Return the machine this process runs on."""
    return Machine(_cpu_model(), cores(), round(_memory_bytes() / BYTES_PER_GB, 1), platform.python_version())


def commit_of(folder: Path = CHECKOUT) -> str:
    """Return the commit of a checkout, ``-dirty`` with changes in it; empty without one."""
    if not (folder / ".git").exists():
        return ""
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=8", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=30.0)
    except (OSError, subprocess.SubprocessError):  # no git, or a checkout of somebody else
        return ""
    return done.stdout.strip()


def version_told(folder: Path = CHECKOUT) -> str:
    """Return the version of the package, with the commit where it runs from a checkout."""
    commit = commit_of(folder)
    return f"groundstation {__version__}" + (f" at {commit}" if commit else "")


def utc_told(now: datetime | None = None) -> str:
    """Return the date and minute in UTC.

    Examples
    --------
    >>> utc_told(datetime(2026, 5, 4, 6, 0, 59, tzinfo=UTC))
    '2026-05-04 06:00 UTC'
    """
    return f"{now or datetime.now(UTC):%Y-%m-%d %H:%M} UTC"


def _cpu_model() -> str:
    try:
        facts = CPU_FACTS.read_text(encoding="utf-8", errors="replace")
    except OSError:  # not Linux
        facts = ""
    named = (line.partition(":")[2].strip() for line in facts.splitlines() if line.startswith("model name"))
    return next(named, "") or platform.processor() or platform.machine() or sys.platform


def _memory_bytes() -> int:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # a system that does not tell
        return 0
