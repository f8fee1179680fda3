"""An independent reference for the virtual orb's mechanics, which shares no code with it.

Three solvers that know nothing of `controller`:

- `dome`: the whole inflated dome, neo-Hookean triangles in space, any fingers anywhere;
- `meridian`: the same dome by its meridian alone, for a finger on the apex;
- `disc`: the linear clamped disc, out of its plane and in it.

Everywhere lengths are in clamped radii R, tensions in mu h0, so pressures in mu h0 / R.
"""
