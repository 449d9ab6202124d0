"""Conventions shared by every room: units, angles, frames, time, errors, records, signals."""
