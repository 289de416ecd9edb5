"""Rotations, rigid transforms, transforms over time, and time stamps."""
