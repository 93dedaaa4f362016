"""Missions: allocation that goes on in time, while tasks appear, agents fail and not everybody knows everything.

`mission` and `events` say what happens, `simulation` what comes of it, `files` and `families` where missions come from.
"""
