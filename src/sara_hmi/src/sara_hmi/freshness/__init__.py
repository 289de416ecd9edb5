"""How fresh a command must be to move the chair, judged by the server's clock alone."""
