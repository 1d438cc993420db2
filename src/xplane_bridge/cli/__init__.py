"""Command-line programs: a parser and `main(argv) -> int` each, started by the launchers in scripts/."""
