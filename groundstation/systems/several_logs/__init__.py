"""Several logs of one flight: their clocks joined, and what the joining shows."""
