"""Offset and drift between the clocks of two logs of one flight.

They are found by GNSS time and by the motion that both logs show.
"""
