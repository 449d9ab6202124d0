"""Tracks of a flight as files of other programs: Google Earth, GPX, NMEA, SBET, tables."""
