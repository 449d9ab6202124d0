"""Runways of the world: the shipped table, and a newer one of the user's."""
