"""The pose graph: key scans as nodes, matches as edges, loops and the test against false ones."""
