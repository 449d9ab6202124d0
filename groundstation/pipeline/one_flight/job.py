"""Task of a run for one log; plain values, so that it travels to a worker process."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import as_log, digest_of, open_log
from groundstation.pipeline.one_flight.resume import Finished, Keys, Step, keys_of
from groundstation.results.manifest import PartOfRun


@dataclass(frozen=True)
class Job:
    """One log to run; plain values, so that it travels to a worker process.

    ``add_suffix``: two flights of one id get ``_<sha8>`` of their logs; ``step`` is what has to be done, with what the
    flight that is ``finished`` has for the rest; ``url`` is where the log is, if ``path`` is but a copy of it. With
    ``only_results`` there is neither a recording nor a report.
    Of several power-ups in the log, ``power_up`` is the only one to run; 0: all of them. ``parts`` are the consecutive
    logs that are run as one flight, the first of them its log.
    """

    path: Path
    out: Path
    configuration: Configuration
    fail_on: str = "none"
    is_named: bool = True
    add_suffix: bool = False
    with_pdf: bool = False
    step: Step = "everything"
    finished: Finished | None = None
    url: str = ""
    only_results: bool = False
    power_up: int = 0
    parts: tuple[PartOfRun, ...] = ()

    @property
    def log(self) -> str:
        """Log as the user would type it."""
        return self.url or str(self.path)

    @property
    def name(self) -> str:
        """Name of its log."""
        return self.path.name

    def asked(self) -> tuple[str, Keys] | None:
        """Return the digest of the log and the keys of its settings.

        None when only the run of the log can tell what is wrong.
        """
        try:
            source = open_log(self.path, self.configuration.profile_path, self.configuration.icds).source
            return source.sha256, keys_of(source, self.configuration)
        except Exception:
            return None

    def digest(self) -> str:
        """Return the digest of its log, whether it can be read or not; empty where there is none."""
        try:
            return digest_of(as_log(self.path))
        except OSError:
            return ""

    def keys_of(self, finished: Finished) -> Keys:
        """Return the keys of this task for a flight of several unchanged logs."""
        digests = [part.sha256 for part in finished.parts]
        return keys_of(finished.source, self.configuration, digests=digests)

    def of_parts(self, parts: Sequence[PartOfRun], *, add_suffix: bool = False) -> "Job":
        """Return the job of running consecutive logs as one flight."""
        first = Path(parts[0].path)
        path = self.path if self.path.absolute() == first else first
        return replace(
            self,
            path=path,
            parts=tuple(parts),
            step="everything",
            finished=None,
            power_up=0,
            url="",
            add_suffix=add_suffix,
        )

    def going_on(self, finished: Finished, keys: Keys) -> "Job":
        """Return the job of what is left to do for a finished flight."""
        step = finished.step(keys, with_pdf=self.with_pdf, only_results=self.only_results)
        add_suffix = step == "analysis" and finished.has_suffix
        power_up = finished.power_up.number if finished.power_up else 0
        return replace(self, step=step, finished=finished, add_suffix=add_suffix, power_up=power_up)
