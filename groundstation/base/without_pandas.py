"""Processes that work through flights do without pandas, which pyarrow would import with the first text that it takes.

pyarrow, and Rerun by it, look for pandas to know a Series when they see one: 0.2 s of every run, report and worker
process, none of which has a Series. For processes of the command line alone: in a notebook everybody's pandas is there.
"""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from types import ModuleType


@cache
def _has_readers_of_others() -> bool:
    """Whether somebody added a format: such a reader may import pandas whenever it likes."""
    from importlib.metadata import entry_points

    return any(not one.value.startswith("groundstation.") for one in entry_points(group="groundstation.readers"))


class _NoPandas:
    """A finder that says there is no pandas."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        if name == "pandas" and not _has_readers_of_others():
            raise ModuleNotFoundError("this process does without pandas", name=name)


def spare_pandas() -> None:
    """From now on this process has no pandas, but within :func:`with_pandas`; one that is loaded stays."""
    if _NoPandas not in sys.meta_path:
        sys.meta_path.insert(0, _NoPandas)


@contextmanager
def with_pandas() -> Iterator[None]:
    """Import here what imports pandas."""
    is_spared = _NoPandas in sys.meta_path
    if is_spared:
        sys.meta_path.remove(_NoPandas)
    try:
        yield
    finally:
        if is_spared:
            spare_pandas()
