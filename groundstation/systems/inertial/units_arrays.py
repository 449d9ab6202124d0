"""Arrays of several units: errors against the reference, differences of pairs."""

from groundstation.results.arrays.typed import Arrays, Floats, Texts


class UnitsErrors(
    Arrays,
    figure="units_errors",
    digits={"time_s": 1, "*_m": 1, "*_mps": 3, "latitude_deg": 6, "longitude_deg": 6},
):
    """Error of each unit against the reference over time, one row a unit and time.

    ``latitude_deg`` and ``longitude_deg`` are those of the unit.
    """

    unit: Texts
    time_s: Floats
    north_m: Floats
    east_m: Floats
    radial_m: Floats
    velocity_mps: Floats
    latitude_deg: Floats
    longitude_deg: Floats


class UnitsPairs(Arrays, figure="units_pairs", digits={"time_s": 1, "*_m": 1, "*_mps": 3, "*_deg": 3}):
    """Difference of every two units over time: distance, length of the velocity, heading."""

    pair: Texts
    time_s: Floats
    radial_m: Floats
    velocity_mps: Floats
    heading_deg: Floats
