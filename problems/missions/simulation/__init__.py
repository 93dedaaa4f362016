"""The reference simulation of missions.

Suggested order of reading: `places` (distances), `state` (agents and tasks now, and their ledgers), `motion` (flights
and work between two events), `changes` (effects of events and orders), `channel` (radio), `reports` and `awareness`
(knowledge), `simulation` (the event loop); beside these `conservation`, `log` and `measures`.
"""
