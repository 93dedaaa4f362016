"""Decentralised methods, in which agents decide by local communication."""
