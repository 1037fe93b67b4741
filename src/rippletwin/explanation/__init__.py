"""Missing physics: what does a calibrated twin lack? Search, localise, check, report."""
