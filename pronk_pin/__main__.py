"""`python -m pronk_pin`, and what the script `pronk-pin` runs: the command line."""

import sys


def main() -> int:
    """Entry point, see `pronk_pin.cli.main`.

    Worker processes import the script that began it all before they watch their parent: this is to
    cost them nothing.
    """
    from .cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
