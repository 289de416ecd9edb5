"""What navsat_transform_node says of itself in /diagnostics, as plain data."""

from __future__ import annotations

import math

from sara_common.diagnostics import ERROR, OK, WARN, Status
from sara_localization.gps.navsat import NavSat

SILENT_AFTER = 5.0
"""s without a usable fix until that is told."""


def status(navsat: NavSat, now: float, last_fix: float | None, before: dict[str, int] | None = None) -> Status:
    """The node's status at a time (s).

    last_fix: when the last fix came (s). before: what `problem_counts` was the last time, for problems are told when
    they are new.
    """
    before = before or {}
    waiting, fix = navsat.waiting_for(), navsat.accounts['fix']
    new = [kind for kind, count in problem_counts(navsat).items() if count > before.get(kind, 0)]
    level, message = OK, f'{fix.used} fixes converted'
    if waiting:
        level, message = ERROR, waiting
    elif last_fix is None or not now - last_fix <= SILENT_AFTER:
        silent = 'yet' if last_fix is None else f'for {now - last_fix:.0f} s'
        level, message = WARN, f'no fix on {fix.topic} {silent}'
    elif new:
        level, message = WARN, 'data are faulty: ' + ', '.join(new)
    values = [(account.topic, account.line(now)) for account in navsat.accounts.values()]
    return Status('navsat_transform', level, message, tuple(values + _world(navsat)))


def problem_counts(navsat: NavSat) -> dict[str, int]:
    """{input and kind of problem: how often}."""
    return {
        f'{name} {kind}': count
        for name, account in navsat.accounts.items()
        for kind, count in sorted(account.problems.items())
    }


def _world(navsat):
    world = navsat.world
    if world is None:
        return []
    a = world.anchor
    return [
        ('anchor (deg, deg, m)', f'{a.latitude:.8f} {a.longitude:.8f} {a.altitude:.2f}'),
        ('anchor in the world frame (m)', '{:.3f} {:.3f} {:.3f}'.format(*a.point)),
        ('heading of the world frame (deg)', f'{math.degrees(a.heading):.3f}'),
        ('heading from', navsat.heading_words),
        ('grid', world.grid.name),
        ('meridian convergence (deg)', f'{math.degrees(world.convergence):.4f}'),
    ]
