"""A person to a metric range: triangulation, body dimensions, fusion."""
