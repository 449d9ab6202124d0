"""Ground stations judged: their places, clocks and datum, and the weight of their errors."""
