"""Who is connected, in which role, and which one of them drives."""
