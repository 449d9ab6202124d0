"""Ground station for post-flight navigation analysis.

The Python API, see docs/api.md: ``flight = groundstation.open("log.ulg")``.
"""

__all__ = [
    "Fleet",
    "GroundstationError",
    "NotAssessableError",
    "OpenFlight",
    "__version__",
    "open",
    "open_fleet",
    "simulate",
]

TYPE_CHECKING = False  # type checkers take it for true; nothing is imported at run time
if TYPE_CHECKING:
    from groundstation.base.errors import GroundstationError, NotAssessableError
    from groundstation.base.version import __version__
    from groundstation.pipeline.api import open_fleet, simulate
    from groundstation.pipeline.api import open_flight as open
    from groundstation.pipeline.fleet_frame import Fleet
    from groundstation.pipeline.notebook import OpenFlight

_HOMES = {
    "__version__": ("groundstation.base.version", "__version__"),
    "Fleet": ("groundstation.pipeline.fleet_frame", "Fleet"),
    "GroundstationError": ("groundstation.base.errors", "GroundstationError"),
    "NotAssessableError": ("groundstation.base.errors", "NotAssessableError"),
    "OpenFlight": ("groundstation.pipeline.notebook", "OpenFlight"),
    "open": ("groundstation.pipeline.api", "open_flight"),
    "open_fleet": ("groundstation.pipeline.api", "open_fleet"),
    "simulate": ("groundstation.pipeline.api", "simulate"),
}


def __getattr__(name: str) -> object:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module, original = _HOMES[name]
    found: object = getattr(import_module(module), original)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)


class _OldPaths:
    """Finder of modules by their old paths, for one release."""

    @staticmethod
    def find_spec(name: str, _path: object = None, _target: object = None) -> object:
        """Return a spec for a path that moved, None for any other."""
        if not name.startswith("groundstation.") or name == "groundstation.base.old_paths":
            return None
        from groundstation.base.old_paths import spec_of

        return spec_of(name)

    @classmethod
    def ask(cls) -> None:
        """Let it be asked where no file is found."""
        import sys

        sys.meta_path.append(cls)  # type: ignore[arg-type]  # importlib.abc takes 30 ms to import


_OldPaths.ask()
