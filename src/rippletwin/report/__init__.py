"""The page: results of a case as one self-contained HTML file."""
