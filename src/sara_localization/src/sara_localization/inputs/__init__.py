"""From an input's messages to measurements of the state."""
