"""Keys of the catalogue of sentences: the server speaks in keys, the page in the rider's language."""
