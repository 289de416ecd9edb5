"""dynamic_reconfigure of move_base and of its planners; the costmaps look after themselves."""

import dataclasses
from typing import Any

import rospy

from sara_common.ros.reconfigure import Reconfigure
from sara_nav.config.parameters import Parameters
from sara_nav.goals.move_base_config import LIMITS
from sara_nav.move_base.local_planners import LOCAL_PLANNERS
from sara_nav.move_base.settings import Settings, read_planner
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.planners.planning import GLOBAL_PLANNERS
from sara_nav.ros.common import TransformListener
from sara_nav.ros.costmap_node import CostmapShell
from sara_nav.ros.publishers import short_name

DYNAMIC = (
    'base_global_planner',
    'base_local_planner',
    'planner_frequency',
    'controller_frequency',
    'planner_patience',
    'controller_patience',
    'max_planning_retries',
    'conservative_reset_dist',
    'recovery_behavior_enabled',
    'clearing_rotation_allowed',
    'shutdown_costmaps',
    'oscillation_timeout',
    'oscillation_distance',
    'make_plan_clear_costmap',
    'make_plan_add_unreachable_goal',
)
"""The fields of the peer's MoveBase.cfg that have an effect."""
CLIENT_LIMITS = {
    **LIMITS,
    'controller_frequency': (0.0, 100.0),
    'planner_patience': (0.0, 100.0),
    'controller_patience': (0.0, 100.0),
    'oscillation_timeout': (0.0, 60.0),
}
"""What dynamic_reconfigure offers: the limits of the peer's MoveBase.cfg, which a YAML may exceed."""


def shells(settings: Settings, machine: MoveBase, tf: TransformListener, lock: Any) -> dict[str, CostmapShell]:
    """The shells of both costmaps. Of their transform_tolerances the global one's is the machine's."""

    def take(tolerance):
        machine.config = dataclasses.replace(machine.config, transform_tolerance=tolerance)
        return ''

    def refuse(_):
        return 'transform_tolerance is that of global_costmap'

    return {
        'global': CostmapShell(settings.global_costmap, machine.global_costmap, tf, lock, take),
        'local': CostmapShell(settings.local_costmap, machine.local_costmap, tf, lock, refuse),
    }


class Tuning:
    """Servers for move_base and its two planners. node: what has ``machine``, ``lock`` and ``reconfigure``."""

    def __init__(self, node: Any):
        self._node = node
        self._planners = {}
        self._offer('global', node.machine.global_planner)
        self._offer('local', node.machine.local_planner)
        self._move_base = Reconfigure('', node.machine.config, CLIENT_LIMITS, self._on_move_base, DYNAMIC)

    def _offer(self, kind, planner):
        if kind in self._planners:
            self._planners.pop(kind).close()
        config = planner.config
        limits = {name: limit[:2] for name, limit in getattr(config, 'LIMITS', {}).items()}
        fixed = getattr(config, 'FIXED', ())
        names = [field.name for field in dataclasses.fields(config) if field.name not in fixed]
        self._planners[kind] = Reconfigure(
            short_name(planner), config, limits, lambda new: self._on_planner(planner, new), names
        )

    def _on_planner(self, planner, config):
        """Take another configuration of a planner: as it can (``reconfigure``), or else by beginning anew with it."""
        with self._node.lock:
            if hasattr(planner, 'reconfigure'):
                planner.reconfigure(config)
            else:
                planner.__init__(config)
                self._node.machine.restart()
        return ''

    def _on_move_base(self, config):
        """Take another configuration of move_base; return '' or why a planner cannot be had."""
        old, made = self._node.machine.config, {}
        tree = Parameters(rospy.get_param('~', {}))
        for kind, registry, name, before in (
            ('global', GLOBAL_PLANNERS, config.base_global_planner, old.base_global_planner),
            ('local', LOCAL_PLANNERS, config.base_local_planner, old.base_local_planner),
        ):
            if name != before:
                made[kind] = read_planner(tree, registry, name)
        if tree.faults:
            return '; '.join(tree.faults)
        with self._node.lock:
            config = dataclasses.replace(config, transform_tolerance=self._node.machine.config.transform_tolerance)
            self._node.reconfigure(config, made.get('global'), made.get('local'))
        for kind, planner in made.items():
            self._offer(kind, planner)
        return ''
