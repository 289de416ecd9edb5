"""Drives the robot to where a map ends until all of it is known."""
