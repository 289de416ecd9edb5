#!/usr/bin/env python3
"""Prints what 10 ms of simulation cost, driving in circles among walls, all chips and sensors on, and where the time
goes.
"""

import cProfile
import pstats
import time

import numpy as np

from canserial.dbc.bus import BusDescription
from sara_sim.chair import SimulatedChair
from sara_sim.options import ChairOptions
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.terrain import Ramp
from sara_sim.world.world import World

STEPS = 20000
CHUNKS = 10
LINES = 25


def walls(**more):
    """A room of 10 x 10 m with a wall into it."""
    occupied = np.zeros((200, 200), bool)
    occupied[[0, -1], :] = occupied[:, [0, -1]] = True
    occupied[100, :60] = True
    return World(occupied, **more)


def drive(chair, steps):
    """Steps with the PC's commands; seconds they took, from the best of `CHUNKS` equal parts (others use the machine
    too).
    """
    bus = BusDescription.default()
    ask = bus.encode('WHEEL_COMMAND', right=0.0, left=0.0, mode=ord('A'))
    go = bus.encode('WHEEL_COMMAND', right=2.0, left=1.2, mode=ord('C'))
    for _ in range(200):
        chair.receive(ask)
        chair.step()
    taken = []
    for _ in range(CHUNKS):
        start = time.perf_counter()
        for tick in range(steps // CHUNKS):
            if tick % 2 == 0:
                chair.receive(go)
            chair.step()
        taken.append(time.perf_counter() - start)
    return CHUNKS * min(taken)


def tell(what, chair):
    """One line."""
    seconds = drive(chair, STEPS)
    print(f'{what:44} {seconds / STEPS * 1e6:5.1f} us per step of 10 ms, {STEPS / 100 / seconds:4.0f} times real time')


def main():
    """Run and print."""
    start = (5.0, 3.0, 0.0)
    SimulatedChair(walls(), 0, start)  # what is compiled is loaded
    taken = []
    for _ in range(CHUNKS):
        before = time.perf_counter()
        chair = SimulatedChair(walls(), 0, start)
        taken.append(time.perf_counter() - before)
    print(f'{"constructor, 30 s of calibration included":44} {1e3 * min(taken):5.1f} ms')
    tell('the reference chair', chair)
    people = [
        Obstacle(f'person {k}', radius=0.25, path=((1.0, 7.0 + 0.5 * k), (9.0, 7.0 + 0.5 * k)), speed=0.8, loop='back')
        for k in range(5)
    ]
    tell('five people walking', SimulatedChair(walls(obstacles=people), 0, start))
    options = ChairOptions(castor_swing=0.02, payload=20.0, payload_x=0.1, collision_shake=True)
    tell(
        'castors, payload, a ramp',
        SimulatedChair(walls(ramps=[Ramp(5.0, 3.0, 2.0, 2.0, 0.0, 0.05)]), 0, start, options=options),
    )
    profile = cProfile.Profile()
    chair = SimulatedChair(walls(), 0, start)
    profile.enable()
    drive(chair, STEPS)
    profile.disable()
    print('\nWhere the time of the reference chair goes (s; the profiler itself costs about as much again):')
    pstats.Stats(profile).strip_dirs().sort_stats('tottime').print_stats(LINES)


if __name__ == '__main__':
    main()
