"""What the large scenes are made with: where their parts go, shapes, plants, places. NumPy and kanuka alone."""
