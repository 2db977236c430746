"""Tables and plots of plot_variants.py."""
