"""Tracks of a flight in the files of other programs: Google Earth, GPX, NMEA, SBET, tables."""
