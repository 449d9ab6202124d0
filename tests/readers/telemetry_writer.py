"""Telemetry logs as ground stations write them: MAVLink frames packed by pymavlink, each behind its time."""

from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as v2

START_US = 1_777_874_400_000_000


class Telemetry:
    """Writes frames as a ground station does."""

    def __init__(self, dialect: Any = v2, system: int = 1) -> None:
        self.dialect, self.data, self.count = dialect, bytearray(), 0
        self.sender = dialect.MAVLink(None, srcSystem=system, srcComponent=1)

    def add(self, name: str, *values: Any, time_us: int | None = None) -> None:
        """A message; without a time one millisecond behind the one before."""
        kind = getattr(self.dialect, f"MAVLink_{name}_message")
        time = START_US + self.count * 1_000 if time_us is None else time_us
        self.data += time.to_bytes(8, "big") + kind(*values).pack(self.sender)
        self.count += 1


def telemetry() -> Telemetry:
    """Attitude, positions and fixes of twenty seconds, heartbeats and a text."""
    log = Telemetry()
    for row in range(200):
        time_us = START_US + row * 100_000
        heading = np.deg2rad((350.0 + row) % 360.0)
        log.add("attitude", row * 100, 0.1, -0.2, heading, 0.01, 0.02, 0.03, time_us=time_us)
        if row % 5 == 0:
            fix = 3 if row else 0
            place = (550_000_000 + row, 370_000_000, 200_000)
            time = time_us + 2_000
            log.add("gps_raw_int", row, fix, *place, 120, 65_535, 500, 9_000, 12, 214_000, 0, 0, 300, time_us=time)
            log.add("global_position_int", row, *place, 0, 100, 200, -50, 0, time_us=time_us + 3_000)
        if row % 10 == 0:
            log.add("heartbeat", 2, 3, 128 if row > 100 else 0, 0, 4, 3, time_us=time_us + 4_000)
    log.add("statustext", 6, b"Landed, safely", time_us=START_US + 30_000_000)
    return log
