"""Names of the events that the autopilot logged.

Arming, modes, landings, failures, and its messages.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.readers.dataflash.rules import EVENTS, MODES
from groundstation.readers.dataflash.values import Rows


def event_names(rows: Rows, vehicle: str) -> NDArray[np.str_] | None:
    """Return a name for each record of EV, ARM, MODE, MSG or ERR.

    None when the type lacks the fields.
    """
    definition = rows.definition
    match definition.name:
        case "MSG" if definition.has_texts("Message"):
            return rows.values("Message")
        case "EV" if definition.has_integers("Id"):
            return _named(rows.values("Id"), lambda number: EVENTS.get(number, f"event {number}"))
        case "ARM" if definition.has_integers("ArmState"):
            return _named(rows.values("ArmState"), lambda state: "armed" if state else "disarmed")
        case "MODE" if definition.has_integers("Mode"):
            known = MODES.get(vehicle, ())
            return _named(rows.values("Mode"), lambda number: _mode(number, known))
        case "ERR" if definition.has_integers("Subsys", "ECode"):
            subsystem, code = (rows.values(name).astype(np.int64) for name in ("Subsys", "ECode"))
            return _named(subsystem * 1000 + code, lambda pair: f"error: subsystem {pair // 1000}, code {pair % 1000}")
    return None


def _mode(number: int, known: tuple[str, ...]) -> str:
    name = known[number] if 0 <= number < len(known) else ""
    return f"mode {name or number}"


def _named(values: NDArray[Any], name_of: Callable[[int], str]) -> NDArray[np.str_]:
    distinct, which = np.unique(values, return_inverse=True)
    return np.array([name_of(value) for value in distinct.tolist()], dtype=np.str_)[which]
