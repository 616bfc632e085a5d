"""Light in the water: sun, sky, waves, lamps, spectra, and the radiance field of open water."""
