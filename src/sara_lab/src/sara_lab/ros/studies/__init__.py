"""Studies and reports that read bags or run nodes."""
