"""INS heading error from GNSS on straight taxi, and what earlier flights teach of the installation."""
