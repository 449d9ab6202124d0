"""``python -m groundstation``, and the command that is installed."""

from groundstation.base.end_of_process import ending_at_once
from groundstation.base.garbage import importing


def start() -> None:
    """Run the command line, which is imported without searches for garbage."""
    with ending_at_once():
        with importing():
            from groundstation.cli.main import main
        main()


if __name__ == "__main__":
    start()
