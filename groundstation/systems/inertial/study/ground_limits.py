"""Limits of the drift while standing, from simulated stands, written as TOML.

``python -m groundstation.systems.inertial.study.ground_limits`` writes the file beside the method.
"""

from pathlib import Path
from zlib import crc32

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.simulation.ins_class import draw_instrument, load_ins_class
from groundstation.simulation.ins_draw import draw_sensor_errors
from groundstation.simulation.ins_errors import TrueMotion, propagate
from groundstation.systems.inertial.alignment_limits import FILE

SEED = 4100  # a seed for tuning
STANDS = 1500  # of each class
ALARM_SHARE = 0.003
LENGTH_S = (60.0, 120.0, 240.0, 360.0, 600.0)
STEP_S = 2.0
HIGHEST_LATITUDE_DEG = 70.0
CLASSES = ("i-21", "mems", "navigation", "tactical")


def slopes_while_standing(ins_class: str, stands: int) -> FloatArray:
    """Return the lengths of the velocity slopes of stands, shape (stands, lengths).

    Half of the stands are those of instruments of their own.
    """
    time_s = np.arange(0.0, max(LENGTH_S) + STEP_S, STEP_S)
    n, found = len(time_s), np.empty((stands, len(LENGTH_S)))
    for run in range(stands):

        def streams(name: str, run: int = run) -> np.random.Generator:
            return np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=(run, crc32(name.encode()))))

        place = streams("place")
        latitude, heading = place.uniform(-HIGHEST_LATITUDE_DEG, HIGHEST_LATITUDE_DEG), place.uniform(0.0, 360.0)
        still = np.zeros(n)
        motion = TrueMotion(time_s, still + latitude, still, still, still, still, still + heading, still)
        ins = load_ins_class(ins_class)
        if run % 2:
            ins = draw_instrument(ins, streams("instrument"))
        errors = propagate(motion, draw_sensor_errors(ins, motion, streams), body_fixed=ins.is_strapdown)
        for column, length_s in enumerate(LENGTH_S):
            rows = time_s < length_s
            found[run, column] = np.hypot(*np.polyfit(time_s[rows], errors.velocity_mps[0][rows], 1)[0])
    return found


def limits_text(stands: int = STANDS) -> str:
    """Return the file of limits."""
    lines = [
        "# Slope of the ground speed that honest units exceed in a share of stands, by class and length of the stand.",
        f"# {stands} simulated stands of a class, half with instruments of their own.",
        "# python -m groundstation.systems.inertial.study.ground_limits",
        f"alarm_share = {ALARM_SHARE}",
        f"length_s = {list(LENGTH_S)}",
        "",
        "[slope_mps2]",
    ]
    for ins_class in CLASSES:
        limit = np.quantile(slopes_while_standing(ins_class, stands), 1.0 - ALARM_SHARE, axis=0)
        lines.append(f'"{ins_class}" = [{", ".join(f"{number:.3g}" for number in limit)}]')
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (Path(__file__).parent.parent / FILE).write_text(limits_text(), encoding="utf-8")
