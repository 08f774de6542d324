"""Run time against error: xPheve and its peers on the same scenes. See docs/benchmarks.md."""
