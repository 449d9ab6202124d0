"""pyarrow looks for pandas once in a process, and is told then that there is none.

pyarrow imports pandas with the first text, number or array that it takes from Python, to know a Series when it sees
one: more than all else that a run, a report or a worker process imports, none of which has a Series. It offers no
switch. Our own conversions go by buffers where that is enough (``base.arrow_values``), so ``info``, ``check`` and
``convert`` never ask; Rerun hands pyarrow Python's values for every recording, so whatever draws one does. What stands
in the way of pandas stands there for that one question: a later ``import pandas`` finds it, and ``to_pandas`` works.
For processes of the command line alone: in a notebook everybody's pandas is there, and given to pyarrow.
"""

import sys
from collections.abc import Sequence
from functools import cache
from types import ModuleType


@cache
def _has_readers_of_others() -> bool:
    """Tell whether somebody added a log format.

    Its reader may hand pyarrow data from pandas.
    """
    from importlib.metadata import entry_points

    return any(not one.value.startswith("groundstation.") for one in entry_points(group="groundstation.readers"))


class _NoPandas:
    """A finder that says there is no pandas."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        if name == "pandas":
            raise ModuleNotFoundError("pyarrow does without pandas here", name=name)


def spare_pandas() -> None:
    """Stop pyarrow in this process from importing pandas from now on.

    A pandas that is loaded or asked for already stays.
    """
    if "pandas" in sys.modules or _has_readers_of_others():
        return
    import pyarrow as pa

    sys.meta_path.insert(0, _NoPandas)
    try:
        pa.array([""])  # here it looks
    finally:
        sys.meta_path.remove(_NoPandas)
