"""Answers judged by a reference in the log: a simulation's truth or a better system."""
