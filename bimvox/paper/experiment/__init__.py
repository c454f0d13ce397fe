"""The paper's experiments: settings, jobs, results, statistics, findings, pictures and the report.

Values in, values out: ``bimvox_pipeline.paper`` runs the jobs in processes and owns the files.
"""
