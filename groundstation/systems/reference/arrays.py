"""Arrays of the comparison with a reference; errors are estimate minus reference."""

from groundstation.results.arrays.typed import Arrays, Flags, Floats, Texts

_PLACE = {"place_north_m": 2, "place_east_m": 2}


class ReferenceErrors(
    Arrays, figure="reference_errors", digits={"time_s": 3, "*_error_m": 4, "*_error_mps": 4, "*_error_deg": 4}
):
    """Errors of every subject over time, with the sigmas that it and the reference claim.

    The two claims are taken together.
    """

    subject: Texts
    time_s: Floats
    north_error_m: Floats
    east_error_m: Floats
    up_error_m: Floats
    north_error_mps: Floats
    east_error_mps: Floats
    up_error_mps: Floats
    roll_error_deg: Floats
    pitch_error_deg: Floats
    heading_error_deg: Floats
    horizontal_sigma_m: Floats
    vertical_sigma_m: Floats
    velocity_sigma_mps: Floats
    roll_sigma_deg: Floats
    pitch_sigma_deg: Floats
    true_heading_sigma_deg: Floats


class ReferenceTrack(Arrays, figure="reference_track", digits={"time_s": 3, **_PLACE}):
    """Plan view of the reference and the subjects, metres from where the reference begins."""

    subject: Texts
    time_s: Floats
    place_north_m: Floats
    place_east_m: Floats


class ReferenceChecks(Arrays, figure="reference_checks", digits={"z": 4}):
    """Samples of every claim, as many as are independent: error over sigma, and the outcome.

    The outcome says whether the claim holds.
    """

    subject: Texts
    quantity: Texts
    axis: Texts
    time_s: Floats
    z: Floats
    is_inside: Flags
