"""The engine: task, record, ledger, sandbox, executor. Knows tasks, not cities."""
