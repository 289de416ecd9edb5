"""Skills that the Wheelchair Skills Test and others ask of somebody in a powered chair, driven and scored."""
