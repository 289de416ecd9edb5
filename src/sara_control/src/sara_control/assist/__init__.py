"""Shared control: the command nearest to the rider's wish that keeps clear of obstacles."""
