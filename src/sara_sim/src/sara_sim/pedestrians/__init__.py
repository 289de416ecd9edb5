"""Pedestrians who see the chair and each other: the social force model, and the paths they walk."""
