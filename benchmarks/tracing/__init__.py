"""What a traced law costs beside the same thing written by hand: benchmarks/tracing/run --help."""
