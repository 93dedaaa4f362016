"""Learned methods: policies trained by reinforcement learning."""
