"""Speed and numbers side by side with other codes: ratios, never thresholds in a test. Run `python -m benchmarks`."""
