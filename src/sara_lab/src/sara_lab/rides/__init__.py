"""Rides: simulated riders steer through circuits, alone, with the safety gate, and with shared control."""
