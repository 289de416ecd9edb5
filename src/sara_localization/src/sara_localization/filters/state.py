"""The 15 variables of the state by name, as robot_localization orders them.

Position and roll, pitch, yaw (m, rad) are those of the robot in the world frame; the velocities (m/s, rad/s) and
accelerations (m/s2) are along the axes of the robot's body (REP-103: x forward, y left, z up).
"""

X, Y, Z, ROLL, PITCH, YAW, VX, VY, VZ, VROLL, VPITCH, VYAW, AX, AY, AZ = range(15)

SIZE = 15
NAMES = ('x', 'y', 'z', 'roll', 'pitch', 'yaw', 'vx', 'vy', 'vz', 'vroll', 'vpitch', 'vyaw', 'ax', 'ay', 'az')

POSITION = slice(X, Z + 1)
ANGLES = slice(ROLL, YAW + 1)
POSE = slice(X, YAW + 1)
VELOCITY = slice(VX, VZ + 1)
RATES = slice(VROLL, VYAW + 1)
TWIST = slice(VX, VYAW + 1)
ACCELERATION = slice(AX, AZ + 1)

# What a robot on a plane does not do: two_d_mode measures these as zero.
OFF_PLANE = (Z, ROLL, PITCH, VZ, VROLL, VPITCH, AZ)
