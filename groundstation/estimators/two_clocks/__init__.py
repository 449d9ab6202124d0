"""The clocks of two logs of one flight: offset and drift between them, by GNSS time and by the motion both show."""
