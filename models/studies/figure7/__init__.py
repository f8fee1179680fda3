"""Figure 7 of the paper: both recipes by the paper's protocol and on unseen days."""
