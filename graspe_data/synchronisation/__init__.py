"""From tracks to rows: clocks, transforms, stretches, the row plan."""
