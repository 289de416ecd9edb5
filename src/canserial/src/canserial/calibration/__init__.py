"""The gyroscope's offset and gain: how they are measured, and the file that keeps them."""
