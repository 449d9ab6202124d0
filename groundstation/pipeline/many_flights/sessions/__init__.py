"""Sessions of several aircraft: found among flights, run, continued."""
