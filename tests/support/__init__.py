"""What tests and benchmarks share and the package does not install: `tests` is on their path, so `import support`."""
