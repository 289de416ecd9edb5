"""Nothing compiles while a robot drives: whatever module of the package has kernels, a node's start, or the making of
what uses them, has them ready.
"""

import importlib

import numpy as np

from ahead_of_time.build import kernel_modules
from sara_nav.costmaps import layered_costmap
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.lattice import planner as lattice_planner
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.move_base import warming
from sara_nav.planners import potential_planner
from sara_nav.planners.global_planner import GlobalPlanner, GlobalPlannerConfig


def test_every_module_with_kernels_is_ready_at_the_start(monkeypatch):
    ready = set()

    def watch(name):
        module = importlib.import_module(name)
        warm = module.warm
        monkeypatch.setattr(module, 'warm', lambda: (ready.add(name), warm()))

    names = set(kernel_modules('sara_nav'))
    for name in names:
        watch(name)
    for module in (lattice_planner, layered_costmap, potential_planner):
        module.warm.cache_clear()
    warming.warm()
    LayeredCostmap(CostmapConfig(), (), np.array([[0.1, 0.1], [0.1, -0.1], [-0.1, -0.1], [-0.1, 0.1]]))
    lattice_planner.LatticePlanner(LatticePlannerConfig())
    GlobalPlanner(GlobalPlannerConfig())
    assert len(names) > 20
    assert names - ready == set()
