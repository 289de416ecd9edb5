"""The node nmea_serial_driver."""
