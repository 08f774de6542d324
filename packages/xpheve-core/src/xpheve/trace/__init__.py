"""Laws read once: what a law's expression computes, as a graph of scalar operations; what it reads; its derivatives and its text."""
