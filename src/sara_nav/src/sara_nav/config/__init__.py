"""Reading and checking parameters."""
