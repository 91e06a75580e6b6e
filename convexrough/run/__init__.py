"""Read a scene file, compute its stages and write the results."""
