"""Arrays of the heading analysis; times are flight seconds, angles degrees."""

from groundstation.results.arrays.typed import Arrays, Counts, Flags, Floats, Texts


class HeadingSamples(
    Arrays,
    figure="heading_samples",
    digits={"time_s": 3, "ground_speed_mps": 3, "heading_deg": 4, "track_deg": 4, "difference_deg": 4, "weight": 3},
):
    """GNSS epochs from first motion to lift-off, with the reason why each is used or not."""

    time_s: Floats
    segment: Counts
    heading_deg: Floats
    track_deg: Floats
    ground_speed_mps: Floats
    difference_deg: Floats
    residual_deg: Floats
    is_used: Flags
    gate: Texts
    weight: Floats


class HeadingLanes(Arrays, figure="heading_lanes", digits={"start_s": 3, "end_s": 3}):
    """Runs of epochs with the same gate, from first motion on."""

    start_s: Floats
    end_s: Floats
    state: Texts


class HeadingRunning(Arrays, figure="heading_running", digits={"time_s": 3}):
    """Running figures of the paper, and the honest half width.

    The half width is held between the steps it was computed at.
    """

    time_s: Floats
    cycles: Counts
    mean_deg: Floats
    sigma_deg: Floats
    precision_deg: Floats
    quality_deg: Floats
    honest_half_width_deg: Floats


class HeadingDistribution(Arrays, figure="heading_distribution"):
    """Histogram of the differences used."""

    bin_low_deg: Floats
    bin_high_deg: Floats
    density_per_deg: Floats


class HeadingNormal(Arrays, figure="heading_normal"):
    """The normal density fitted to the differences."""

    difference_deg: Floats
    density_per_deg: Floats


class HeadingGrowth(Arrays, figure="heading_growth", digits={"time_s": 3}):
    """The histogram as it grows, over equal bins at every step."""

    step: Counts
    time_s: Floats
    bin_center_deg: Floats
    density_per_deg: Floats


class HeadingSpectrum(Arrays, figure="heading_spectrum"):
    """Spectral density of the residuals and that of the fitted noise model, one-sided."""

    frequency_hz: Floats
    density_deg2_per_hz: Floats
    model_deg2_per_hz: Floats


class StandstillVelocity(
    Arrays, figure="standstill_velocity", digits={"time_s": 3, "velocity_north_mps": 4, "velocity_east_mps": 4}
):
    """Velocity of GNSS at standstill."""

    time_s: Floats
    velocity_north_mps: Floats
    velocity_east_mps: Floats
    is_in_interval: Flags


class StandstillMeanSpeed(Arrays, figure="standstill_mean_speed", digits={"window_s": 0}):
    """Density of the speed of the mean velocity over windows of 10 s and 30 s."""

    window_s: Floats
    speed_of_mean_mps: Floats
    density_per_mps: Floats
