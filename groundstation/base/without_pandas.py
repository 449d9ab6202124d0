"""Finder that hides pandas from pyarrow, which then does not load it.

pyarrow imports pandas with the first text, number or array that it takes from Python, to recognise a Series. This
import costs more than all else that a run, a report or a worker process imports, and none of them has a Series.
pyarrow offers no switch. It looks for pandas once in a process. Our own conversions go by buffers where that is enough
(``base.arrow_values``), so ``info``, ``check`` and ``convert`` never ask. Rerun hands pyarrow Python's values for every
recording, so whatever draws one does. The finder here answers that one question only: a later ``import pandas`` finds
pandas, and ``to_pandas`` works. It serves processes of the command line alone: in a notebook pandas is there, and given
to pyarrow.
"""

import sys
from collections.abc import Sequence
from functools import cache
from types import ModuleType

from groundstation.base.plug_ins import entry_points_of


@cache
def _has_code_of_others() -> bool:
    """Tell whether somebody added a log format or a system.

    Such code may hand pyarrow data from pandas.
    """
    added = (entry_points_of(group) for group in ("groundstation.readers", "groundstation.systems"))
    return any(not one.value.startswith("groundstation.") for found in added for one in found)


class _NoPandas:
    """Finder of modules that says there is no pandas."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        if name == "pandas":
            raise ModuleNotFoundError("pyarrow does without pandas here", name=name)


def spare_pandas() -> None:
    """Stop pyarrow in this process from importing pandas from now on.

    A pandas that is loaded or asked for already stays.
    """
    if "pandas" in sys.modules or _has_code_of_others():
        return
    import pyarrow as pa

    sys.meta_path.insert(0, _NoPandas)
    try:
        pa.array([""])  # here it looks
    finally:
        sys.meta_path.remove(_NoPandas)
