"""Water and materials: refractive index, absorption, scattering, mirrors and port materials."""
