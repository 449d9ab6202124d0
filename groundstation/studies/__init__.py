"""Monte Carlo behind the published figures."""
