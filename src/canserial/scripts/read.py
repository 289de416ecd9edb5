#!/usr/bin/env python3
"""canrx -> imu/data, ranges, encoders, ...."""

import os
import sys

# Its neighbour canserial.py bears the name of the package: their folder must not be searched for it.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]

from canserial.ros.read_node import main  # noqa: E402

if __name__ == '__main__':
    main()
