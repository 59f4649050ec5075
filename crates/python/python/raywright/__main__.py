"""The program: `python -m raywright`, or `raywright` where the wheel is installed."""

import signal
import sys

from . import _raywright


def main():
    # It watches for Ctrl-C itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _raywright.main(["raywright", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
