"""Data as a page holds it: JSON, compressed, in an alphabet that needs no escaping in HTML."""

import base64
import gzip


def compressed(text: str) -> str:
    """Return a text compressed by gzip, in base64: whatever it holds, a browser sees none of it as HTML or script."""
    return base64.b64encode(gzip.compress(text.encode(), 6, mtime=0)).decode("ascii")
