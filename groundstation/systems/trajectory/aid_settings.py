"""Settings of the aids beside GNSS.

No sideways motion, barometer, wheels, magnetic heading.
"""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import number


@dataclass(frozen=True)
class AidSettings:
    """Switches of the aids, and limits beyond which one is left out.

    Parameters
    ----------
    use_no_sideways_motion : bool
        False: what rolls may slip and leave the ground. It serves what rolls alone, stated or found, where its
        direction of travel in the unit is steady; never what flies, walks or floats.
    use_barometer : bool
        False: barometric height is not used.
    use_wheel_speed : bool
        False: the speed of wheels is not used. It serves what rolls alone, with ``use_no_sideways_motion``.
    use_magnetic_heading : bool
        False: a magnetic heading is not used. It serves alone where the aircraft file states the deviation of its
        compass.
    barometer_topic : str
        Topic of the barometer; empty: the first that agrees with GNSS.
    wheel_topic : str
        Topic of the speed of wheels; empty: the first that agrees with GNSS.
    compass_topic : str
        Topic of the magnetic heading; empty: chosen by the tool.
    """

    use_no_sideways_motion: bool = True
    use_barometer: bool = True
    use_wheel_speed: bool = True
    use_magnetic_heading: bool = True
    barometer_topic: str = ""
    wheel_topic: str = ""
    compass_topic: str = ""
    # A barometer that shows one height for so long, while GNSS climbs, is stuck; chosen.
    stuck_s: float = number(30.0, 2.0, 3600.0)
    # Climb of GNSS that a stuck barometer does not show, at least; 4 sigmas of GNSS where those are more; chosen.
    stuck_climb_m: float = number(8.0, 0.1, 1000.0)
    # A barometric height whose scale beside GNSS is farther from 1 has another unit; chosen.
    scale_limit: float = number(0.15, 0.01, 1.0)
    # A larger jump of the barometric height that stays, and that GNSS does not show, leaves the barometer out; chosen.
    jump_m: float = number(8.0, 0.5, 1000.0)
    # Mean squared innovation of an aid over what is expected at most, else it is left out; chosen.
    nis_max: float = number(2.0, 1.0, 100.0)
    # Share of the readings of an aid that the gate let in at least, else it is left out; chosen.
    used_share_min: float = number(0.9, 0.0, 1.0)
    # A magnetic heading farther from that of the motion, in sigmas, is left out; chosen.
    heading_sigmas: float = number(3.0, 1.0, 100.0)
