"""Random frames against the touch screen's server."""
