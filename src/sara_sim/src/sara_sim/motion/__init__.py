"""How the chair moves: wheels, slip, castors, walls."""
