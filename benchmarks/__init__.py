"""Speed side by side with other codes, in one run: ratios, never thresholds in a test. Run `python -m benchmarks`."""
