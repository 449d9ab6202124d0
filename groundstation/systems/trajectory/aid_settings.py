"""Settings of the aids beside GNSS: barometer, wheels, magnetic heading."""

from dataclasses import dataclass

from groundstation.base.toml_settings import number


@dataclass(frozen=True)
class AidSettings:
    """Switches of the aids, and limits beyond which one is left out.

    Parameters
    ----------
    use_barometer, use_wheel_speed, use_magnetic_heading : bool
        False: the aid is not used. Wheels serve what rolls alone, a magnetic heading alone where the aircraft file
        states the deviation of its compass.
    barometer_topic, wheel_topic, compass_topic : str
        Named by the user; empty: chosen.
    """

    use_barometer: bool = True
    use_wheel_speed: bool = True
    use_magnetic_heading: bool = True
    barometer_topic: str = ""
    wheel_topic: str = ""
    compass_topic: str = ""
    stuck_s: float = number(30.0, 2.0, 3600.0)  # one height for so long, while GNSS climbs, is stuck
    stuck_climb_m: float = number(8.0, 0.1, 1000.0)  # it climbs more than that, and than 4 sigmas of it
    scale_limit: float = number(0.15, 0.01, 1.0)  # of barometric height beside GNSS: beyond it the unit is another
    jump_m: float = number(8.0, 0.5, 1000.0)  # that stays, while GNSS and its velocity show none
    nis_max: float = number(2.0, 1.0, 100.0)  # mean squared innovation over what is expected
    used_share_min: float = number(0.9, 0.0, 1.0)  # of its readings; the gate kept the others out
    heading_sigmas: float = number(3.0, 1.0, 100.0)  # magnetic heading from that of the motion
