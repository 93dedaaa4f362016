"""Solving as a service for other programs: asynchronous, over lines of JSON, and over HTTP."""
