"""Any load path, and frictional shakedown: what varies when the normal load varies too."""
