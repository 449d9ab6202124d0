"""Heading error of the INS from GNSS on straight taxi, and the installation learned."""
