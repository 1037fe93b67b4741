"""Where a mismatch sits: free corrections along the line, residual bands, shaft orders."""
