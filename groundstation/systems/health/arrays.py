"""Arrays of autopilot health: grades over time, and the quantities behind."""

from groundstation.results.arrays.typed import Arrays, Counts, Floats, Texts


class HealthLanes(Arrays, figure="health_lanes", digits={"start_s": 2, "end_s": 2}):
    """Spans in which the worst quantity of a check is good, amber or red.

    ``check`` is its title, ``grade`` one of ``good``, ``amber``, ``red`` and ``not logged`` (the log pauses). Events
    are drawn as short spans. Other time without a span is time in which nothing of the check is logged.
    """

    check: Texts
    start_s: Floats
    end_s: Floats
    grade: Texts


class HealthSeries(Arrays, figure="health_series", digits={"time_s": 2, "value": 6}):
    """Quantities over time, thinned to the worst value of each short span.

    ``measure`` is the place of the quantity among the measures of the answer, all checks in their order.
    """

    measure: Counts
    time_s: Floats
    value: Floats


class HealthMotors(Arrays, figure="health_motors", digits={"time_s": 2, "value": 3}):
    """Outputs to the motors around the loss of control of attitude."""

    output: Counts
    time_s: Floats
    value: Floats
