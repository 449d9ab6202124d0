"""Arrays of a fleet: control charts, forecast skill and checks of every flight."""

from groundstation.results.arrays.typed import Arrays, Counts, Flags, Floats, Texts, Times


class FleetTrend(Arrays, figure="trend"):
    """Control charts: a row per flight, quantity and aircraft, in order of time.

    They hold aircraft with enough flights that have a time. ``level`` is the median between change points, ``low`` and
    ``high`` are the control limits; ``limit`` is what the quantity itself shall not reach, NaN where none is stated.
    """

    aircraft: Texts
    quantity: Texts
    flight_id: Texts
    start_utc: Times
    value: Floats
    level: Floats
    low: Floats
    high: Floats
    is_outside: Flags
    limit: Floats


class FleetSkillFlights(Arrays, figure="skill_flights"):
    """The shipped method of every flight, by horizon."""

    flight_id: Texts
    aircraft: Texts
    start_utc: Times
    method: Texts
    horizon_min: Floats
    starts: Counts
    rms_m: Floats
    coverage95: Floats


class FleetChecks(Arrays, figure="calibration_checks"):
    """Every check of a flight's answers, those of rejected flights too."""

    quantity: Texts
    flight_id: Texts
    aircraft: Texts
    verdict: Texts
    residual_deg: Floats
    sigma_deg: Floats
    z: Floats
    is_inside: Flags


class FleetInstallationFlights(Arrays, figure="installation_flights"):
    """Flights of every installation: knowledge from earlier flights, answers, residual."""

    place: Counts
    aircraft: Texts
    ins_serial: Texts
    flight_id: Texts
    start_utc: Times
    not_taught: Texts
    flights: Counts
    verdict_alone: Texts
    verdict: Texts
    error_deg: Floats
    half_width_deg: Floats
    alone_error_deg: Floats
    alone_half_width_deg: Floats
    platform_error_deg: Floats
    platform_standard_error_deg: Floats
    residual_deg: Floats
    residual_sigma_deg: Floats
    mounting_deg: Floats
    mounting_sigma_deg: Floats
    sum_deg: Floats
    sum_sigma_deg: Floats
    factor: Floats
    factor_sigma: Floats
    odd: Floats
    changed: Floats
