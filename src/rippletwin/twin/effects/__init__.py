"""Effects: physics that a twin may lack, one module each."""
