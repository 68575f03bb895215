"""The commands: run, plan, status, explain, rerun, evaluate and others."""
