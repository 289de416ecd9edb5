"""The node amcl."""
