"""What is reported of an address where no Dask scheduler answers."""

NO_ANSWER = "no scheduler answers"
NO_ANSWER_REMEDY = (
    "check the address and that the scheduler runs (dask scheduler); where it has TLS, the address begins with tls:// "
    "and DASK_CONFIG names the certificates; leave --scheduler out to run locally"
)
