"""The simulated chair and its world, seen from outside only as the bytes of a Lawicel CANUSB adapter."""
