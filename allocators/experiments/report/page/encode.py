"""Encoding of data in a page: compressed JSON in an alphabet that needs no escaping in HTML."""

import base64
import gzip


def compressed(text: str) -> str:
    """Return a text as gzip in base64, so that a browser cannot interpret any of it as HTML or script."""
    return base64.b64encode(gzip.compress(text.encode(), 6, mtime=0)).decode("ascii")
