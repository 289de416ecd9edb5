"""rosbridge v2 for pages made with roslibjs or roslibpy: messages as JSON and CBOR, an allow-list, bounded queues."""
