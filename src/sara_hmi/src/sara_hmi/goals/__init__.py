"""The page's goal: going, paused, and how it ended."""
