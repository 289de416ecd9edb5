"""Frames of the page's protocol: what may come, and how much of it."""
