"""``python -m groundstation``, and the command that is installed."""

from groundstation.base.garbage import importing


def start() -> None:
    """Run the command line, which is imported without searches for garbage."""
    with importing():
        from groundstation.cli.main import main
    main()


if __name__ == "__main__":
    start()
