"""Many scenes: their enumeration, the measures, the workers, and the table."""
