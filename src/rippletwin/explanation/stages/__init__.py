"""The stages of a search: what is fitted, and searching again with what a search has shown."""
