"""What calibrate_odometry prints: the multipliers with their uncertainty, the error before and after, and the YAML to
use.
"""

import math

from sara_control.calibration.calibration import Calibration

TURNS_SCALED = 0.03
"""Share of its turns by which a robot turns otherwise once it is calibrated, from which on that is said."""


def report(calibration: Calibration, runs: list) -> str:
    """Text. runs: of calibration.end_errors."""
    c = calibration
    left, right = (math.degrees(angle) for angle in c.turned)
    lines = [
        f'on the spot {left:.0f} deg to the left and {right:.0f} deg to the right, '
        f'{c.legs[0]} straight legs of {c.legs[1]:.2f} m; '
        f'gyroscope bias {math.degrees(c.bias):+.4f} deg/s, '
        f'{math.degrees(c.residual):.2f} deg (rms) of a move not explained',
        '',
        f'{"":30}{"multiplier":>11}{"+-":>10}',
    ]
    lines += [f'{name:30}{value:11.5f}{sigma:10.5f}' for name, value, sigma in _rows(c)]
    if min(c.turned) < 0.5 * max(c.turned):
        lines += [
            '',
            'turned mostly one way: turn as much the other way, '
            'or an error of the gyroscope passes for one of the track',
        ]
    if abs(c.separation - 1.0) > TURNS_SCALED:
        lines += [
            '',
            'with this wheel_separation_multiplier turns are as commanded: divide turn_slip '
            f'(safety_gate, shared_control) by {c.separation:.3f} (1 where less comes out), or the slip of castors '
            'counts twice',
        ]
    lines += ['', f'{"run":>4}{"start s":>12}{"way m":>9}{"turned deg":>12}   error of the end before -> after']
    for number, run in enumerate(runs, 1):
        lines.append(
            f'{number:4}{run.start:12.1f}{run.way:9.2f}{math.degrees(run.turned):12.1f}   '
            f'{run.position_before:.3f} m, {math.degrees(run.heading_before):.2f} deg -> '
            f'{run.position_after:.3f} m, {math.degrees(run.heading_after):.2f} deg'
        )
    return '\n'.join(lines)


def yaml_text(calibration: Calibration) -> str:
    """Parameters for the controller."""
    return ''.join(f'{name}: {value:.6f}  # +- {sigma:.6f}\n' for name, value, sigma in _rows(calibration))


def _rows(c):
    return (
        ('wheel_separation_multiplier', c.separation, c.separation_sigma),
        ('left_wheel_radius_multiplier', c.left, c.left_sigma),
        ('right_wheel_radius_multiplier', c.right, c.right_sigma),
    )
