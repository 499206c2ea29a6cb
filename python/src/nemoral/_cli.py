"""The command ``nemoral``, which this package brings."""

from __future__ import annotations

import signal
import sys

from . import _native


def main() -> int:
    """Run the command with this process's arguments and return its exit code."""
    # Python's own handler would wait until the command has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.run_program(["nemoral", *sys.argv[1:]], _native.__file__)


if __name__ == "__main__":
    sys.exit(main())
