"""May the data and the explanation be believed?

Contradictions in the data, alarms, cross-validation, prior sensitivity, profile intervals and the
null distribution.
"""
