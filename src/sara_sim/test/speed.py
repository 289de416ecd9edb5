#!/usr/bin/env python3
"""Prints what 10 ms of simulation cost, driving in circles among walls."""

import time

import numpy as np
from canserial.bus import BusDescription
from sara_sim.chair import SimulatedChair
from sara_sim.world import World

STEPS = 20000


def main():
    """Run and print."""
    occupied = np.zeros((200, 200), bool)
    occupied[[0, -1], :] = occupied[:, [0, -1]] = True
    occupied[100, :60] = True
    bus = BusDescription.default()
    chair = SimulatedChair(World(occupied), 0, (5.0, 3.0, 0.0), bus)
    ask = bus.encode('WHEEL_COMMAND', right=0.0, left=0.0, mode=ord('A'))
    drive = bus.encode('WHEEL_COMMAND', right=2.0, left=1.2, mode=ord('C'))
    for _ in range(200):
        chair.receive(ask)
        chair.step()
    start = time.perf_counter()
    for tick in range(STEPS):
        if tick % 2 == 0:
            chair.receive(drive)
        chair.step()
    seconds = time.perf_counter() - start
    print(f'{seconds / STEPS * 1e6:.1f} us per step of 10 ms, {STEPS / 100 / seconds:.0f} times real time, {chair.contacts} contacts')


if __name__ == '__main__':
    main()
