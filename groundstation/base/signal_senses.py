"""Senses of the canonical fields: which way is positive, and where it is measured.

Fields of a row share the text; parts between semicolons are theirs in order. ``truth`` has those of ``ins``.
"""

SENSES: tuple[tuple[str, tuple[str, ...], str], ...] = (
    ("ins", ("latitude_deg", "longitude_deg"), "geodetic, north and east positive"),
    ("ins", ("altitude_ellipsoid_m", "altitude_msl_m"), "up positive"),
    ("ins", ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps"), "over the ground; a climb is negative"),
    ("ins", ("roll_deg", "pitch_deg"), "right wing down, nose up positive"),
    ("ins", ("true_heading_deg", "magnetic_heading_deg"), "nose, clockwise"),
    (
        "ins",
        ("rate_x_dps", "rate_y_dps", "rate_z_dps"),
        "about forward, right, down; right wing down, nose up, nose right positive",
    ),
    ("ins", ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2"), "specific force forward, right, down: z is -9.8 at rest"),
    ("ins", ("mode", "valid"), "align, nav, attitude or gnss_aided; the unit calls its output valid"),
    ("ins", ("ground_speed_mps",), "where it is logged without its direction"),
    (
        "ins",
        ("position_north_m", "position_east_m", "position_down_m"),
        "local frame, where the log has no place on the globe",
    ),
    (
        "ins",
        (
            "roll_sigma_deg",
            "pitch_sigma_deg",
            "true_heading_sigma_deg",
            "horizontal_sigma_m",
            "vertical_sigma_m",
            "velocity_sigma_mps",
        ),
        "the system's own estimate of its error, one sigma",
    ),
    (
        "gnss",
        (
            "latitude_deg",
            "longitude_deg",
            "altitude_ellipsoid_m",
            "altitude_msl_m",
            "velocity_north_mps",
            "velocity_east_mps",
            "velocity_down_mps",
        ),
        "as of ins",
    ),
    ("gnss", ("track_deg", "ground_speed_mps"), "motion, clockwise from true north; horizontal"),
    ("gnss", ("gdop", "pdop", "hdop"), "dilution of precision"),
    ("gnss", ("satellites_used", "satellites_tracked", "constellation"), "numbers; systems used"),
    (
        "gnss",
        ("integrity_ok", "fix"),
        "vouched for by the receiver; none, 2d, 3d, dgnss, rtk_float, rtk_fixed, ppp, gnss_ins, dead_reckoning, other",
    ),
    ("gnss", ("cn0_dbhz", "age_of_corrections_s"), "mean carrier to noise density; differential corrections"),
    (
        "gnss",
        (
            "horizontal_sigma_m",
            "vertical_sigma_m",
            "velocity_sigma_mps",
            "position_north_sigma_m",
            "position_east_sigma_m",
            "velocity_north_sigma_mps",
            "velocity_east_sigma_mps",
            "velocity_down_sigma_mps",
        ),
        "the receiver's own estimate, one sigma",
    ),
    (
        "imu",
        ("delta_angle_x_rad", "delta_angle_y_rad", "delta_angle_z_rad"),
        "turned about forward, right, down over the interval that ends at the record",
    ),
    (
        "imu",
        ("delta_velocity_x_mps", "delta_velocity_y_mps", "delta_velocity_z_mps"),
        "integral of specific force over it",
    ),
    (
        "imu",
        ("interval_s", "velocity_interval_s"),
        "its length, else the time since the record before; that of delta_velocity",
    ),
    (
        "imu",
        ("rate_x_dps", "rate_y_dps", "rate_z_dps", "accel_x_mps2", "accel_y_mps2", "accel_z_mps2"),
        "samples, axes as of ins",
    ),
    (
        "imu",
        ("is_integral", "temperature_c", "gyro_clipping", "accel_clipping"),
        "increments, not samples; of the unit; axes at the end of their range",
    ),
    (
        "onboard",
        ("heading_error_deg", "precision_deg", "quality_deg", "cycles"),
        "INS true heading - true heading as the aircraft computed it; e, quality, samples",
    ),
    ("onboard", ("correction_entered_deg", "status"), "negative of the error; its state"),
    ("magnetometer", ("field_forward_nt", "field_right_nt", "field_down_nt"), "magnetic field"),
    ("electric", ("current_a",), "near the magnetometer"),
    (
        "baro",
        ("pressure_altitude_m", "height_above_airfield_m"),
        "in the standard atmosphere; as the source computed it",
    ),
    ("air", ("true_airspeed_mps", "indicated_airspeed_mps"), "through the air"),
    ("air", ("wind_north_mps", "wind_east_mps"), "velocity of the air, towards north, east"),
    ("radio_altimeter", ("height_m",), "above the ground below"),
    (
        "gnss_integrity",
        (
            "horizontal_protection_sbas_m",
            "horizontal_protection_fd_m",
            "vertical_protection_sbas_m",
            "vertical_protection_fd_m",
        ),
        "protection level by augmentation, by fault detection",
    ),
    ("gnss_integrity", ("horizontal_alarm_limit_m", "vertical_alarm_limit_m"), "a level above it is no guidance"),
    (
        "guidance",
        ("lateral_deviation_dots", "vertical_deviation_dots"),
        "aircraft right of the course, above the path; two dots are full scale",
    ),
    ("guidance", ("source", "frequency_mhz", "course_magnetic_deg"), "GPS, NAV1, ILS; tuned; selected"),
    ("discrete", ("weight_on_wheels", "wheel_speed_mps"), "true on the ground; a wheel of the main gear"),
    (
        "configuration",
        ("flap_deg", "gear_down", "gear_nose_down", "gear_left_down", "gear_right_down"),
        "extended positive; down and locked",
    ),
    ("engine", ("n1_share", "power_share", "throttle_share"), "1 is rated, full"),
    ("event", ("name", "severity"), "marker or command; info, warn or fail"),
    (
        "link",
        ("pseudorange_m", "transmission_time_s", "slot", "rank"),
        "range with clock offset; time slot; rank of the peer",
    ),
    ("link", ("position_x_m", "position_y_m", "position_z_m"), "position that the peer broadcasts, ECEF"),
    (
        "link",
        (
            "covariance_xx_m2",
            "covariance_xy_m2",
            "covariance_xz_m2",
            "covariance_yy_m2",
            "covariance_yz_m2",
            "covariance_zz_m2",
        ),
        "its covariance",
    ),
    ("link", ("relative_bearing_deg",), "of the peer from the nose, clockwise"),
    ("satellite", ("pseudorange_m", "x_m", "y_m", "z_m"), "range with clock offset; satellite at emission, ECEF"),
    ("adf", ("relative_bearing_deg",), "of the beacon from the nose, clockwise"),
    ("odometry", ("speed_mps", "turn_rate_dps"), "of the wheels, forwards and to the right positive"),
    (
        "corrected_heading",
        ("magnetic_heading_deg", "uncorrected_magnetic_heading_deg", "deviation_deg", "true_heading_deg"),
        "uncorrected + deviation; as shown; added; + declination",
    ),
)


def sense_of(topic: str, field: str) -> str:
    """Return the sense of a field, empty where there is none.

    Examples
    --------
    >>> sense_of("air", "wind_north_mps")
    'velocity of the air, towards north, east'
    """
    return next((sense for name, fields, sense in SENSES if name == topic and field in fields), "")
