"""The command multiplexer: which of several sources drives."""
