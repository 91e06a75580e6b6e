"""A scene file in, result files out."""
