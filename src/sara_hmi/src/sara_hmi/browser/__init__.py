"""A headless Chromium with the page in it: for tests, pictures and measurements."""
