"""Maps built while driving."""
