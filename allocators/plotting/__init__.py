"""Drawings of results, fronts, fleets and runs, for programs, notebooks and the command line; needs matplotlib."""

from alloc.allocators.plotting.convergence import plot_convergence
from alloc.allocators.plotting.figure import plot
from alloc.allocators.plotting.fleets import plot_whatif
from alloc.allocators.plotting.front import plot_front
from alloc.allocators.plotting.style import check_plot

__all__ = ["check_plot", "plot", "plot_convergence", "plot_front", "plot_whatif"]
