"""``python -m groundstation``."""

from groundstation.cli.main import main

main()
