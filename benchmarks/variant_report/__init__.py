"""What plot_variants.py makes of JSON of bench_variants."""
