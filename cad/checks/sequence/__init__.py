"""In which order a mount is put together, which way each part comes in, and where the key for each screw goes."""
