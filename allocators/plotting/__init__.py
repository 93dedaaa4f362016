"""Plots of results, fronts, fleets, runs and missions, for programs and the command line; needs matplotlib."""

from alloc.allocators.plotting.convergence import plot_convergence
from alloc.allocators.plotting.figure import plot
from alloc.allocators.plotting.fleets import plot_whatif
from alloc.allocators.plotting.front import plot_front
from alloc.allocators.plotting.missions.animation import animate_mission, check_animation
from alloc.allocators.plotting.missions.picture import plot_mission
from alloc.allocators.plotting.style import check_plot

__all__ = [
    "animate_mission",
    "check_animation",
    "check_plot",
    "plot",
    "plot_convergence",
    "plot_front",
    "plot_mission",
    "plot_whatif",
]
