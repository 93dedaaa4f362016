"""The entry of `alloc`: Ctrl-C while modules are still being loaded gives a line, as it does later."""


def start() -> int:
    """Run `alloc` with the arguments of the process, and return its exit code."""
    try:
        from alloc.cli.main import main
    except KeyboardInterrupt:
        from alloc.cli.output.console import interrupted

        return interrupted()
    return main()
