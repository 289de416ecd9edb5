"""The server's parameters and limits."""
