"""Flights with several INS units, one of which may be faulty."""
