"""The server without sockets and without a robot: frames in, actions out."""
