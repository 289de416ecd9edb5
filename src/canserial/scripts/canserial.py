#!/usr/bin/env python3
"""CAN adapter <-> canrx, cantx."""

import os
import sys

# This file bears the name of its package: its folder must not be searched for it.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]

from canserial.ros.adapter_node import main  # noqa: E402

if __name__ == '__main__':
    main()
