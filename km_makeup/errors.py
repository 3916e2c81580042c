"""The one family of errors that KM Makeup raises for input it cannot use."""


class MakeupError(ValueError):
    """Bad input: the message is one sentence that says what is wrong, where, and what to do."""
