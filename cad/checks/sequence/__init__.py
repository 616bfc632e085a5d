"""In which order a mount is put together, on which path each part comes in, and where the key for each screw goes."""
