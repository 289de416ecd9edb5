"""What is compiled, made ready before the robot drives: nothing is to compile, or be loaded, in the middle of a control
cycle.

Costmaps and the planners with a lattice or a potential do so when they are made; the rest may be called whichever
planners there are, or come later.
"""

from sara_nav.move_base import local_planners as local_planner
from sara_nav.planners import grid_kernels as kernels


def warm() -> None:
    """Compile, or load from the cache, every kernel that whoever drives may call."""
    for module in (kernels, local_planner):
        module.warm()
