"""Grids and shapes: cells, footprints, collision, clearance and distances."""
