class DepthPersonError(Exception):
    """A fault that its user can mend; the message says what is wrong and what to do."""
