"""Recorded laser logs, and how far estimated poses are off true relations."""
