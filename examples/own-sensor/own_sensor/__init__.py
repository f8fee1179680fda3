"""A sensor for OrbTouch in a package of its own."""
