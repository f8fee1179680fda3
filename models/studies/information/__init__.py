"""Information in the signals of an orb: section 6 of the paper, its errors, and its open questions.

    histogram         entropies of single sensors as in the paper, corrected, and under no relation
    knn               mutual information from nearest neighbours, neighbours in time excluded
    classifier_bound  lower bounds from classifiers on held-out days
    channel           capacity per use and per minute of a noisy channel (Blahut-Arimoto), and games
    vocabulary        vocabularies of two gestures, three, ... as such channels
    study             data sets and measurement of all parts
    tables, report    storage, the results as Markdown, and drawings

Everything is in nats; multiply by `histogram.BITS` for bits. docs/information.md states what each
estimate assumes.
"""
