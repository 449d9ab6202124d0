"""Arrays of an acceptance: radial errors against hours of navigation."""

from groundstation.results.arrays.typed import Arrays, Counts, Floats


class AcceptanceGrowth(Arrays, figure="acceptance_growth", digits={"hours": 4, "*_nmi": 4}):
    """Errors of all flights by hours of navigation, with 50 % and 95 % bounds and 2 dRMS.

    The 95 % bound is an order statistic.
    """

    hours: Floats
    flights: Counts
    cep50_nmi: Floats
    r95_nmi: Floats
    two_drms_nmi: Floats
    bound95_nmi: Floats


class AcceptanceCurves(Arrays, figure="acceptance_curves", digits={"hours": 4, "radial_nmi": 4}):
    """Radial error of each flight over its hours."""

    flight: Counts
    hours: Floats
    radial_nmi: Floats
