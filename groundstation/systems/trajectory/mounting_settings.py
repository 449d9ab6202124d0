"""Limits by which the mounting of an inertial unit is found or refused."""

from dataclasses import dataclass

from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class MountingSettings:
    """Limits of the search for the axes of the case.

    Log-likelihoods are over ``correlation_factor``: errors of neighbouring changes of velocity are not independent.
    """

    # Spans of dead reckoning
    step_s: float = number(1.0, 0.2, 10.0)  # between the fixes whose change of velocity is compared
    steps: int = number(8, 4, 60)
    imu_step_s: float = number(0.05, 0.005, 0.5)
    lag_max_s: float = number(1.5, 0.0, 5.0)  # GNSS against the unit
    lag_step_s: float = number(0.1, 0.01, 1.0)
    spans_max: int = number(60, 5, 1000)  # those with the most motion
    motion_min_mps2: float = number(0.25, 0.01, 20.0)  # RMS of the horizontal acceleration of a span
    velocity_floor_mps: float = number(0.1, 0.001, 10.0)  # error of a change of velocity of a good receiver
    correlation_factor: float = number(4.0, 1.0, 100.0)

    # What the unit shows
    spans_min: int = number(4, 2, 1000)  # fewer tell nothing
    margin_min: float = number(5.0, 0.5, 1000.0)  # log units by which an unsound explanation is likelier: refused
    margin_doubt: float = number(1.5, 0.1, 1000.0)  # likewise: told as a doubt
    hidden_force_mps2: float = number(0.6, 0.0, 10.0)  # RMS along an axis whose sign a bias of 50 mg hides
    over_others_min: float = number(10.0, 1.0, 1000.0)  # log units over other times of GNSS
    unexplained_max: float = number(0.35, 0.01, 1.0)  # of the variance of GNSS's changes of velocity
    over_others_clear: float = number(40.0, 1.0, 1000.0)  # so many: the unit is of this vehicle, its GNSS is poor
    unexplained_clear_max: float = number(0.65, 0.01, 1.0)
    misfit_max_mps: float = number(1.0, 0.01, 100.0)  # RMS of a change of velocity in a step
    unrelated_motion_mps: float = number(0.25, 0.05, 20.0)  # change of velocity in a step that a unit cannot miss
    gravity_range_mps2: tuple[float, float] = (8.0, 12.5)  # median; aircraft in turns and cars on bad roads are inside

    # How it stands
    speed_min_mps: float = number(3.0, 0.5, 50.0)  # of travel that shows forward
    flight_speed_min_mps: float = number(6.0, 1.0, 100.0)
    travel_steps_min: int = number(20, 3, 10_000)
    concentration_min: float = number(0.9, 0.5, 1.0)  # length of the mean of unit vectors: 0.9 is 26 degrees
    flown_on_s: float = number(60.0, 5.0, 3600.0)  # without a stop: what does so flies nose first
    flown_turn_deg: float = number(300.0, 30.0, 3600.0)  # meanwhile
    square_within_deg: float = number(25.0, 1.0, 45.0)  # else the case stands at an angle, which is measured
    contradiction_deg: float = number(45.0, 10.0, 180.0)  # between what is stated and what motion shows

    def __post_init__(self) -> None:
        check_ranges(self)
