"""Plain shapes, many at once: tubes, boxes, leaves, blades and blobs."""
