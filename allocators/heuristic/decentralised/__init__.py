"""Decentralised methods: agents decide on what they and their neighbours know."""
