"""Arrays of a placement: places of the points, accuracy under each design."""

from groundstation.results.arrays.typed import Arrays, Flags, Floats, Texts, column


class PlacementPoints(Arrays, figure="placement_points"):
    """Places of the points in each design."""

    design: Texts
    label: Texts = column("name")
    north_m: Floats
    east_m: Floats
    up_m: Floats
    is_placed: Flags


class PlacementAccuracy(Arrays, figure="placement_accuracy"):
    """Accuracy along the user's way under each design."""

    time_s: Floats
    design: Texts
    north_m: Floats
    east_m: Floats
    up_m: Floats
    dop: Floats
    two_sigma_north_m: Floats
    two_sigma_east_m: Floats
    two_sigma_up_m: Floats


class PlacementKeepOut(Arrays, figure="placement_keep_out"):
    """Corners of the areas in which no point may stand."""

    label: Texts = column("name")
    north_m: Floats
    east_m: Floats


class PlacementMap(Arrays, figure="placement_map"):
    """Accuracy by where the last point stands."""

    north_m: Floats
    east_m: Floats
    sigma_m: Floats
    determinant: Floats
