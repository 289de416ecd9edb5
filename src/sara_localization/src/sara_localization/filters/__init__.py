"""The filters: state, motion model, EKF and UKF, and their compiled algebra."""
