"""Logs on disk: one scenario as a flat CSV, and the sample logs of the repository.

The sample logs come with their README.
"""

from pathlib import Path

import numpy as np

from groundstation.base.units import NS_PER_S
from groundstation.simulation.faults import describe
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.flight import Simulated, scenario_truth, simulate
from groundstation.simulation.scenario import load_scenario

SAMPLES = ("taxi-good", "taxi-short", "taxi-drift", "taxi-damaged", "taxi-notime")
PAPER_SPEED_MPS = 6.0


def write_scenario(name_or_path: str | Path, folder: str | Path, seed: int | None = None) -> Path:
    """Simulate a scenario and write its log ``<folder>/<scenario>.csv``.

    The log is damaged as the scenario says.

    Returns
    -------
    Path
        The log.

    Raises
    ------
    SettingsError
        When there is no such scenario or it cannot be flown.
    """
    return write_log(simulate(load_scenario(name_or_path), seed), folder)


def write_log(simulated: Simulated, folder: str | Path) -> Path:
    """Write the log of a simulated flight into a folder, which is made when missing."""
    scenario = simulated.scenario
    path = Path(folder) / f"{scenario.name}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_flat_csv(
        path,
        simulated.damaged,
        resolution=simulated.resolution,
        delimiter=scenario.log.delimiter,
        encoding=scenario.log.encoding,
        with_truth=scenario.truth.written,
        cut_bytes=scenario.log.cut_bytes,
    )
    return path


def make_sample_logs(folder: str | Path) -> tuple[Path, ...]:
    """Write the sample logs and the README that tells the truth behind them.

    The bytes are the same every time.

    Returns
    -------
    tuple of Path
        The logs in the order of :data:`SAMPLES`, then README.md.
    """
    simulated = [simulate(load_scenario(name)) for name in SAMPLES]
    paths = [write_log(one, folder) for one in simulated]
    readme = Path(folder) / "README.md"
    readme.write_bytes(readme_text(simulated).encode())
    return (*paths, readme)


def readme_text(simulated: list[Simulated]) -> str:
    """Return the README of the sample logs: contents, true values and damage of each."""
    logs = [_log_line(one) for one in simulated]
    truths = [_truth_line(one) for one in simulated]
    damage = [f"- `{one.scenario.name}.csv`: {text}." for one in simulated for text in _damage_of(one)]
    return "\n".join([_HEAD, *logs, _TRUTH_HEAD, *truths, _DAMAGE_HEAD, *damage, ""])


_HEAD = """\
# Sample logs

These logs are simulated: no aircraft was recorded. `make_sample_logs` of groundstation/simulation/samples.py writes the
logs and this page; tests/simulation/test_sample_logs.py makes them again and compares every byte. To write one log:
`groundstation simulate NAME -o DIR`. The format is the flat CSV: `#` lines of metadata, one time column,
`<topic>.<field>` columns; an empty cell means no sample.

| log | what it shows | minutes | above 6 m/s on wheels, s | verdict to expect |
|---|---|---|---|---|"""
_TRUTH_HEAD = """
## The truth behind them

Heading error = INS heading - true heading at log second 0; it grows by the drift. The parking heading is that of the
nose. The reference is the reading of a theodolite, with its own error; the log's metadata hold it. The antenna is
ahead of the middle of the main-gear axle.

| log | heading error, deg | drift, deg/h | parking heading, deg | reference, deg | antenna ahead, m | seed |
|---|---|---|---|---|---|---|"""
_DAMAGE_HEAD = """
## Damage done on purpose

Log seconds are those of the undamaged clock.
"""


def _log_line(simulated: Simulated) -> str:
    scenario, motion = simulated.scenario, simulated.trajectory
    fast = np.hypot(motion.velocity_north_mps, motion.velocity_east_mps) > PAPER_SPEED_MPS
    fast_s = float(np.count_nonzero(fast & ~motion.airborne)) * motion.step_ns / NS_PER_S
    minutes = len(motion) * motion.step_ns / NS_PER_S / 60.0
    cells = [f"`{scenario.name}.csv`", scenario.title, f"{minutes:.1f}", f"{fast_s:.0f}", scenario.expected_verdict]
    return f"| {' | '.join(cells)} |"


def _truth_line(simulated: Simulated) -> str:
    truth = scenario_truth(simulated)
    cells = [
        f"`{simulated.scenario.name}.csv`",
        f"{truth['heading_error_deg']:+.2f}",
        f"{truth['drift_deg_per_h']:+.2f}",
        f"{truth['parking_heading_deg']:.2f}",
        f"{truth['reference_heading_deg']:.2f}",
        f"{truth['antenna_forward_m']:.1f}",
        str(simulated.scenario.seed),
    ]
    return f"| {' | '.join(cells)} |"


def _damage_of(simulated: Simulated) -> list[str]:
    scenario = simulated.scenario
    found = [describe(fault) for fault in scenario.faults]
    if scenario.log.cut_bytes:
        found.append(f"the last {scenario.log.cut_bytes} bytes are missing: the last line is cut")
    if not scenario.start_utc:
        found.append("no start_utc: the log has no absolute time")
    return found
