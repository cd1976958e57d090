"""`python -m tumble` is the program `tumble`."""

import sys

from tumble import _tumble


def main() -> int:
    """Runs the program with this process's arguments."""
    return _tumble.run(["tumble", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
