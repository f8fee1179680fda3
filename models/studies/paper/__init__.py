"""The paper's figures 7 and 9 and its section 6, repeated on simulated people or on recordings.

    figure7           both recipes by the paper's protocol, and on unseen days and people
    section6          entropies of single sensors as in the paper, corrected, and under no relation;
                      a bound on the information that a bundle's answers carry on held-out days
    study             measurement of all parts
    tables, drawings  the results as Markdown and SVG

Information is in nats; multiply by `section6.BITS` for bits.
"""
