"""The training machine, and the bundles that ship."""
