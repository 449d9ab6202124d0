"""Letters of the coefficients of a compass deviation, A to E."""

LETTERS = ("A", "B", "C", "D", "E")
