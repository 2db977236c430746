"""Tables, charts and the page of plot_evaluation.py."""
