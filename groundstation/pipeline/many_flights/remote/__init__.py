"""Logs and results elsewhere, in a bucket or on a server."""
