"""What plot_evaluation.py makes of JSON of bench_evaluation."""
