"""Limits of honest units from simulated flights of each class, written as TOML.

``python -m groundstation.systems.inertial.study.units_limits`` writes the file beside the method.
"""

from collections import defaultdict
from itertools import combinations
from pathlib import Path
from zlib import crc32

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.simulation.ins_class import InsClass, draw_instrument, load_ins_class
from groundstation.simulation.ins_draw import draw_heading_wander, draw_sensor_errors
from groundstation.simulation.ins_errors import propagate
from groundstation.simulation.routes import Route, RouteKind, draw_route
from groundstation.systems.inertial.units_growth import MEAN_S, S_PER_H, means_of
from groundstation.systems.inertial.units_limits import FILE

SEED = 4000  # a seed for tuning
FLIGHTS = 240  # of each class; three units each
FALSE_ALARM_SHARE = 0.004  # of flights in which one limit is exceeded
HOURS = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
BEGUN_H = 2.0  # at most before the log, where nobody knows
STEP_S = 2.0
ROUTES: tuple[RouteKind, ...] = ("straight", "manoeuvring", "out_and_back", "dogleg", "racetrack", "late_survey")
CLASSES = ("i-21", "mems", "navigation", "tactical")
UNITS = 3
NAMES = ("rate_nmiph", "velocity_mps", "heading_deg")

Errors = tuple[FloatArray, FloatArray, FloatArray]  # position (n, 2), velocity (n, 2), heading (n,) in degrees


def _stream(name: str, *key: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=(*key, crc32(name.encode()))))


def errors_of(ins: InsClass, route: Route, run: int, unit: int) -> Errors:
    """Errors of one unit along a route; all units of a flight share the gravity on their way."""

    def streams(name: str) -> np.random.Generator:
        return _stream(name, run) if name == "deflection" else _stream(name, run, unit + 1)

    motion = route.motion
    sensors = draw_sensor_errors(ins, motion, streams, body_fixed=ins.is_strapdown)
    errors = propagate(motion, sensors, body_fixed=ins.is_strapdown)
    wander = draw_heading_wander(streams("heading"), motion.time_s, motion.heading_deg[0], ins.heading)
    return errors.position_m[0], errors.velocity_mps[0], np.rad2deg(errors.azimuth_rad[0]) + wander


def statistics_of(time_s: FloatArray, errors: Errors, start_s: float, *, is_known: bool) -> FloatArray:
    """Return rate, velocity RMS and heading of a difference over each length of flight.

    Shape (lengths, 3); they are those of :func:`growth_of`, for all lengths at once.
    """
    rows = time_s >= start_s
    elapsed, values = means_of(time_s[rows] - start_s, np.column_stack([*errors[:2], wrap_180(errors[2])])[rows])
    position = values[:, :2] if is_known else values[:, :2] - values[0, :2]
    hours, radial = elapsed / S_PER_H, np.hypot(*position.T) / M_PER_NAUTICAL_MILE
    rate = np.cumsum(hours * radial) / np.cumsum(hours**2)
    velocity = np.sqrt(np.cumsum(np.sum(values[:, 2:4] ** 2, axis=1)) / np.arange(1, len(elapsed) + 1))
    last = np.searchsorted(hours, HOURS) - 1
    heading = [abs(float(np.median(values[: row + 1, 4]))) for row in last]
    return np.column_stack([rate[last], velocity[last], heading])


def simulated(ins_class: str, flights: int) -> dict[tuple[str, str], FloatArray]:
    """Statistics of honest units of a class, by start and kind of difference."""
    last_s = (max(HOURS) + BEGUN_H) * S_PER_H + 2.0 * MEAN_S
    time_s = np.arange(0.0, last_s, STEP_S)
    found: dict[tuple[str, str], list[FloatArray]] = defaultdict(list)
    for run in range(flights):
        route = draw_route(ROUTES[run % len(ROUTES)], time_s, _stream("route", run))
        ins = load_ins_class(ins_class)
        own = [
            draw_instrument(ins, _stream("instrument", run, unit + 1)) if run // len(ROUTES) % 2 else ins
            for unit in range(UNITS)
        ]
        units = [errors_of(one, route, run, unit) for unit, one in enumerate(own)]
        begun_s = float(_stream("begun", run).uniform(0.0, BEGUN_H * S_PER_H))
        pairs = [_less(units[second], units[first]) for first, second in combinations(range(UNITS), 2)]
        for start, start_s in (("known", 0.0), ("unknown", begun_s)):
            for kind, several in (("single", units), ("pair", pairs)):
                for one in several:
                    found[start, kind].append(statistics_of(time_s, one, start_s, is_known=start == "known"))
    return {key: np.array(values) for key, values in found.items()}


def _less(one: Errors, other: Errors) -> Errors:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def limits_text(flights: int = FLIGHTS) -> str:
    """Return the file of limits."""
    lines = [
        "# Growth that honest units exceed in a share of flights, by class and length of flight.",
        f"# {flights} simulated flights of a class, three units each, on {len(ROUTES)} kinds of route; half of the",
        "# flights with instruments of their own. python -m groundstation.systems.inertial.study.units_limits",
        f"false_alarm_share = {FALSE_ALARM_SHARE}",
        f"hours = {list(HOURS)}",
    ]
    for ins_class in CLASSES:
        for (start, kind), values in simulated(ins_class, flights).items():
            if kind == "single":
                lines.append(f'\n[classes."{ins_class}".{start}]')
            limit = np.quantile(values, 1.0 - FALSE_ALARM_SHARE, axis=0)
            for column, name in enumerate(NAMES):
                numbers = ", ".join(f"{number:.4g}" for number in limit[:, column])
                lines.append(f"{kind}_{name} = [{numbers}]")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (Path(__file__).parent.parent / FILE).write_text(limits_text(), encoding="utf-8")
