"""The simulated chair and the whole stack in one process, stepped by a simulated clock."""
