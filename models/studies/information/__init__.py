"""Information in an orb's signals: the paper's section 6, its errors, and what it left open.

    histogram   the paper's statistics, corrected ones, and what chance alone would give
    neighbours  mutual information from distances (Ross, Kraskov), temporal neighbours left out
    heldout     lower bounds: what a classifier names on a day that it never saw
    contrast    lower bounds: telling what belongs together from what does not (InfoNCE)
    channel     bits per command and per minute over a noisy channel (Blahut-Arimoto)
    games       played games as such a channel
    vocabulary  the same for two gestures, three, ...
    growth      taxels, length of the window, rate, bits of the converter

Everything is in nats; multiply by `histogram.BITS` for bits. docs/information.md says what each
assumes.
"""
