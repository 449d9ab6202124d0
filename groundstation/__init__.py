"""Ground station for post-flight navigation analysis."""

__version__ = "0.1.0"
