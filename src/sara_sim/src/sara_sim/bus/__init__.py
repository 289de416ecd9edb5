"""The adapter and the bus as far as the PC: Lawicel bytes, a pseudo-terminal, late and lost frames."""
