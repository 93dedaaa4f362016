"""What comes of a mission and of orders: the reference simulation.

To be read in this order: `places` (how far apart), `state` (agents and tasks now, and their ledgers), `motion` (flights
and work between two events), `changes` (what an event does), `channel` (radio), `reports` and `awareness` (who knows
what), `simulation` (from event to event), and beside it `conservation`, `log` and `measures`.
"""
