"""Limits by which the mounting of an inertial unit is found or refused."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class MountingSettings:
    """Limits of the search for the axes of the case.

    Log-likelihoods are over ``correlation_factor``: errors of neighbouring changes of velocity are not independent.
    """

    # Spans of dead reckoning

    # Length of a step between GNSS fixes whose change of velocity is compared with the unit's; chosen.
    step_s: float = number(1.0, 0.2, 10.0)
    steps: int = number(8, 4, 60)  # number of steps in a span of dead reckoning; chosen
    # Step to which rates and forces of the unit are summed in a span; chosen.
    imu_step_s: float = number(0.05, 0.005, 0.5)
    lag_max_s: float = number(1.5, 0.0, 5.0)  # largest lag of GNSS behind the unit that is tried, either way; chosen
    lag_step_s: float = number(0.1, 0.01, 1.0)  # step of the lags that are tried; chosen
    spans_max: int = number(60, 5, 1000)  # so many spans are used, those with the most motion; chosen
    # RMS horizontal acceleration of a span that is used at least; chosen.
    motion_min_mps2: float = number(0.25, 0.01, 20.0)
    # Least error of a change of velocity by GNSS, that of a good receiver; chosen.
    velocity_floor_mps: float = number(0.1, 0.001, 10.0)
    # Log-likelihoods are divided by it: errors of neighbouring changes of velocity are not independent; chosen.
    correlation_factor: float = number(4.0, 1.0, 100.0)

    # What the unit shows
    spans_min: int = number(4, 2, 1000)  # fewest spans that tell anything of the axes; chosen
    # Log units by which an unsound explanation of the axes must be likelier for the unit to be refused; chosen.
    margin_min: float = number(5.0, 0.5, 1000.0)
    # Log units by which an unsound explanation of the axes must be likelier for a doubt; chosen.
    margin_doubt: float = number(1.5, 0.1, 1000.0)
    # RMS force along an axis below which a bias of 50 mg hides its sign: no mirror image is told; chosen.
    hidden_force_mps2: float = number(0.6, 0.0, 10.0)
    # Log units by which the own time of GNSS must fit better than other times; chosen.
    over_others_min: float = number(10.0, 1.0, 1000.0)
    # Share of the variance of GNSS's changes of velocity that the unit may leave unexplained; chosen.
    unexplained_max: float = number(0.35, 0.01, 1.0)
    # So many log units over other times show that unit and GNSS are of one vehicle, whose GNSS is poor; chosen.
    over_others_clear: float = number(40.0, 1.0, 1000.0)
    # Share of the variance that may be unexplained where over_others_clear is reached; chosen.
    unexplained_clear_max: float = number(0.65, 0.01, 1.0)
    misfit_max_mps: float = number(1.0, 0.01, 100.0)  # RMS misfit of a change of velocity in a step at most; chosen
    # Change of velocity in a step that a unit on the same vehicle cannot miss; chosen.
    unrelated_motion_mps: float = number(0.25, 0.05, 20.0)
    # Median specific force of a unit within; aircraft in turns and cars on bad roads are inside; chosen.
    gravity_range_mps2: tuple[float, float] = (8.0, 12.5)

    # How it stands

    # Least speed of travel that shows which way is forward, of what rolls or walks; chosen.
    speed_min_mps: float = number(3.0, 0.5, 50.0)
    # Least speed of travel that shows which way is forward, of what flies; chosen.
    flight_speed_min_mps: float = number(6.0, 1.0, 100.0)
    travel_steps_min: int = number(20, 3, 10_000)  # fewest steps of travel that show which way is forward; chosen
    # Least length of the mean of unit vectors of travel and of gravity: 0.9 is 26 degrees; chosen.
    concentration_min: float = number(0.9, 0.5, 1.0)
    # Flight for so long without a stop, with flown_turn_deg of turns, is nose first; chosen.
    flown_on_s: float = number(60.0, 5.0, 3600.0)
    # Least sum of turns in flown_on_s of a flight that is nose first; chosen.
    flown_turn_deg: float = number(300.0, 30.0, 3600.0)
    # A case farther from the axes of the vehicle stands at an angle, which is measured; chosen.
    square_within_deg: float = number(25.0, 1.0, 45.0)
    # Angle between the stated mounting and what motion shows that contradicts it; chosen.
    contradiction_deg: float = number(45.0, 10.0, 180.0)

    def __post_init__(self) -> None:
        check_ranges(self)
