"""The rider's touch screen: what the page may do, how fresh a command must be, and the server of the page."""
