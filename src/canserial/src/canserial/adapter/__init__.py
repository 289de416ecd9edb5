"""The CAN adapter: settings, the Lawicel byte stream, reconnection, frames waiting to be sent, bus load."""
