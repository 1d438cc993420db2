"""The root of this package's exceptions."""


class XplaneBridgeError(Exception):
    """Something a user can put right; the text is one line: what was given, what was expected, what to do."""
