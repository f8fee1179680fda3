"""An independent reference for the virtual orb's mechanics, which shares no code with it.

Two solvers that know nothing of `controller`:

- `dome`: the whole inflated dome, neo-Hookean triangles in space, any fingers anywhere;
  `friction`: fingers that slide on it, under two laws; `touches`: a frozen set of their touches;
- `mesh`: the linear clamped disc, out of its plane and in it.

Everywhere lengths are in clamped radii R, tensions in mu h0, so pressures in mu h0 / R.
"""
