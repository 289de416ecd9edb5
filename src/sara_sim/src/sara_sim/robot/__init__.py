"""Any differential robot on a map, with odometry, laser scanners and its true pose."""
