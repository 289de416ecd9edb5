#!/usr/bin/env python3
"""The simulated chair in one process: `one_process.py MAP.yaml`, with (1, 1) free and the way to (4, 1) and (4, 3).

A simulated rider drives it by its joystick while somebody walks about and frames get lost. The same seed, frames and
faults give the same frames, to the last bit.
"""

import sys

from sara_sim.chair import STEP_S, SimulatedChair
from sara_sim.options import ChairOptions
from sara_sim.riders.riders import RIDERS, Task, rider
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import World


def drive(world, seconds, name='tremor', seed=0):
    """Let a rider (of RIDERS) drive for so long (s). Returns the chair and the frames that the PC received."""
    world.obstacles.add(Obstacle('ann', radius=0.25, path=((2, 3), (5, 3)), speed=0.8, start=5.0, loop='back'))
    options = ChairOptions(collision_shake=True)
    chair = SimulatedChair(world, seed=seed, start=(1.0, 1.0, 0.0), options=options)
    chair.faults.add('frames_dropped', probability=0.1, ids=['IMPACT_GYRO'], duration=2.0)
    task = Task(way=((1, 1), (4, 1), (4, 3)), goals=((4, 1), (4, 3)))  # m, map frame
    person = rider(name, task, seed=seed)
    frames = []
    for step in range(round(seconds / STEP_S)):
        left, forward = person.stick(step * STEP_S, chair.pose)  # -1..1, as the axes of sensor_msgs/Joy
        chair.joystick = (round(512 - 511 * left), round(512 + 511 * forward))  # raw: right, forward
        frames += chair.step()  # a PC would answer by chair.receive(frame)
    return chair, frames


def main():
    """Drive on a map by every rider."""
    for name in RIDERS:
        chair, frames = drive(World.from_yaml(sys.argv[1]), 20.0, name)
        x, y, yaw = chair.pose
        print(f'{name}: at ({x:.2f}, {y:.2f}, {yaw:.2f}), {len(frames)} frames, {chair.contacts} contacts')


if __name__ == '__main__':
    main()
