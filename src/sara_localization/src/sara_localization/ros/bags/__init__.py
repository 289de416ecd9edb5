"""The tools that filter and check recorded bags."""
