"""Benches of running nodes."""
