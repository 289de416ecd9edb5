"""The chair's chips: IMU, ultrasonic rangers, encoders, and the I2C bus they sit on."""
