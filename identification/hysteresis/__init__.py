"""Forces with memory from logs of force against displacement: sliders first, then laws that start from them."""
