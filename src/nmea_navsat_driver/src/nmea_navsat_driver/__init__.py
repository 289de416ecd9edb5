"""A GPS receiver that speaks NMEA 0183: sentences, fixes, and the node that publishes them."""
