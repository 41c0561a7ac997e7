"""Questions asked of both solvers: scenes, runs, metrics, results and charts."""
