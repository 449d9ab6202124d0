"""Several logs of one flight: how they were joined, how well their motions agree, which sources are used."""
