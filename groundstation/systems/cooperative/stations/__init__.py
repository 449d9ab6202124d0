"""Ground stations judged: their places, clocks and datum, and what an error of theirs does to the answer."""
