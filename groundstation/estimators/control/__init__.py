"""How aircraft should move and where ground points should stand, for the accuracy one needs."""
