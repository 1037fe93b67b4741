"""Where does the mismatch act, and what quantity is missing there?

Free corrections along the line, the missing immittance, residual bands, shaft orders, and fits with
an unknown source.
"""
