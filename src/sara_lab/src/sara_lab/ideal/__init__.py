"""The ideal time of a journey: the fastest motion of the body through the known map that a profile's limits allow."""
