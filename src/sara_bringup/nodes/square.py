#!/usr/bin/env python3
from sara_bringup.ros.square_node import main

main()
