"""Random inputs against the parts of the stack that must survive them."""
