"""Hard iron of a recorded ArduPilot flight: ours beside that of MAGFit, as pymavlink ships it (magfit_WMM.py).

Both fit with the log's own attitude, ours in flight, MAGFit the whole log. No figure-eight and no independent INS
stands behind it: what is compared is the fit, not a deviation. Offsets are ArduPilot's, milligauss to be added to the
raw reading.
"""

import os
import re
import subprocess
import sys
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.recorded import LOGS, are_here
from groundstation.integrity.ordering import corrected
from groundstation.integrity.survey import survey
from groundstation.readers.dataflash import read
from groundstation.readers.source import Source
from groundstation.systems.magnetic.earth import earth_field
from groundstation.systems.magnetic.iron import Iron
from groundstation.systems.magnetic.modulus import fit_modulus
from groundstation.systems.magnetic.poisson import EarthField, fit_iron
from groundstation.systems.magnetic.readings import choose_topics, gather
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.phases import flight_phases

LOG = LOGS / "dataflash" / "TestLog2_REENCODED_plane.BIN"
NT_PER_MILLIGAUSS = 100.0
VECTOR = r"Vector3\((\S+), (\S+), (\S+)\)"
Array = NDArray[np.float64]


def main() -> None:
    """Print offsets and what each leaves of the modulus of the field."""
    if not are_here(LOG):
        return
    items = list(read(Source(LOG)))
    found = survey(items)
    flight = flight_from_batches(
        corrected(items, found.clock), metadata={}, has_utc=found.clock.is_absolute, source_name=LOG.name
    )
    settings = MagneticSettings(attitude_condition_max=1e6, modulus_condition_max=1e6, modulus_sigma_max_deg=180.0)
    readings, _latency_s = gather(flight, choose_topics(flight), None, settings)
    readings = readings.take(np.isin(flight_phases(flight).at(readings.time_s), ("airborne", "unknown")))
    _along, declination, earth = earth_field(flight, readings, np.arange(len(readings)), settings)
    strength = float(np.hypot(earth.horizontal_nt, earth.down_nt))
    spans = f"banks {_span(readings.roll_deg)}, pitch {_span(readings.pitch_deg)}"
    print(f"{LOG.name}: {len(readings)} readings in flight, {spans}")
    print(f"field of {declination.model}: {strength:.0f} nT, declination {declination.value_deg:.2f} deg")
    logged = np.array([flight["raw.MAG"].values(f"Ofs{axis}")[0] for axis in "XYZ"])
    attitude, modulus = fit_iron(readings, earth, settings), fit_modulus(readings.field_nt, earth, settings)
    sigma = np.sqrt(np.diag(attitude.covariance))[9:12] / NT_PER_MILLIGAUSS
    rows = {
        "as logged": (Iron(np.eye(3), np.zeros(3)), ""),
        "iron fit": (attitude.iron, f"sigma {_three(sigma)}, condition {attitude.condition_number:.0f}"),
        "hard iron fit": (_hard_alone(readings.field_nt, earth), "offsets and one scale, modulus of the model"),
        "modulus fit": (modulus.iron, f"condition {modulus.condition_number:.0f} {modulus.reason}"),
    }
    for name, options in (("MAGFit", ()), ("MAGFit --elliptical", ("--elliptical",))):
        offsets, diagonal, off_diagonal, scale = magfit(LOG, *options)
        a, b, c = off_diagonal
        matrix = scale * (np.diag(diagonal) + np.array([[0, a, b], [a, 0, c], [b, c, 0]]))
        rows[name] = (Iron(np.linalg.inv(matrix), (logged - offsets) * NT_PER_MILLIGAUSS), f"scale {scale:.3f}")
    for name, (iron, remark) in rows.items():
        offsets = logged - iron.hard_nt / NT_PER_MILLIGAUSS
        left = np.linalg.norm(iron.field_nt(readings.field_nt), axis=1)
        varies = f"modulus {left.mean():6.0f} nT, varies by {left.std():5.0f}"
        print(f"  {name:20} offsets {_three(offsets)} mG; {varies}  {remark}")


def _hard_alone(field_nt: Array, earth: EarthField) -> Iron:
    """Offsets and a common scale by least squares of the modulus against the model's: what MAGFit fits without more."""
    from scipy.optimize import least_squares

    strength = float(np.hypot(earth.horizontal_nt, earth.down_nt))

    def left(parameters: Array) -> Array:
        return np.asarray(np.linalg.norm(field_nt / strength - parameters[:3], axis=1) / parameters[3] - 1.0)

    found = least_squares(left, [0.0, 0.0, 0.0, 1.0]).x
    return Iron(found[3] * np.eye(3), found[:3] * strength)


def magfit(path: Path, *options: str) -> tuple[Array, Array, Array, float]:
    """Offsets, diagonal, off-diagonal and scale that MAGFit finds."""
    script = str(resources.files("pymavlink") / "tools" / "magfit_WMM.py")
    command = [sys.executable, script, "--att-source", "ATT", "--reduce", "4", *options, str(path)]
    environment = os.environ | {"MPLBACKEND": "Agg"}
    told = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    line = next((one for one in told.stdout.splitlines() if one.startswith("New: ")), None)
    if line is None:
        raise SystemExit(f"MAGFit failed: {(told.stderr or told.stdout).strip().splitlines()[-1]}")
    vectors = [np.array([float(value) for value in found]) for found in re.findall(VECTOR, line)]
    return vectors[0], vectors[1], vectors[2], float(line.rsplit("scale: ", 1)[1])


def _three(values: Array) -> str:
    return "({})".format(", ".join(f"{value:7.1f}" for value in values))


def _span(values: Array) -> str:
    low, high = np.percentile(values, (1, 99))
    return f"{low:.0f} to {high:.0f} deg"


if __name__ == "__main__":
    main()
