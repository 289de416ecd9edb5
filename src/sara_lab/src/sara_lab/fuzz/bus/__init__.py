"""Random bytes and frames against canserial."""
