"""Answers judged by a reference in the log: the truth of a simulation, or a better system on board."""
