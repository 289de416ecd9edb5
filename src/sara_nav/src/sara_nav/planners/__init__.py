"""The interface of planners, and the global planners on cells: navfn, global_planner, GridPlanner."""
