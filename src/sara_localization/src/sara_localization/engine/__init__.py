"""The filter as a machine: data in as it arrives, estimates out at every period."""
