"""Tables of papers whose experiment is more than frames of a few methods, a module each."""
