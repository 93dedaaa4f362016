"""Decentralised methods: agents decide on local communication."""
