"""The sensor node: an MPU6050 and nine SRF02s on I2C, and the frames they become."""
