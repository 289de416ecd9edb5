#!/usr/bin/env python3
from sara_bringup.ros.square import main

main()
