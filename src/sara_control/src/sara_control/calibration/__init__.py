"""Track and wheel radii of a differential drive from a recorded drive (UMBmark)."""
