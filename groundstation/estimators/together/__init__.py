"""Several logs of one flight: how they are joined, how well they agree, which are used.

The motions of the logs are compared; the sources in use are listed.
"""
