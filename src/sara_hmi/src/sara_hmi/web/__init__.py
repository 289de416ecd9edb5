"""The web server: page, WebSocket, certificate, QR code."""
