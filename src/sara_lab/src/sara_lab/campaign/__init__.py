"""Everything that is judged over many chairs: `make campaign`."""
