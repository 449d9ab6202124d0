"""Arrays of the latency between sensors."""

from groundstation.results.arrays.typed import Arrays, Floats, Texts


class LatencySearch(Arrays, figure="latency_search", digits={"latency_s": 3, "residual": 6}):
    """Residual against delay of every pair of sources."""

    reference: Texts
    other: Texts
    quantity: Texts
    latency_s: Floats
    residual: Floats
