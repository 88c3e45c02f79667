"""What all tests need."""

import signal

# A shell starts background jobs with SIGINT ignored; then an interrupt would reach no test that waits for one.
signal.signal(signal.SIGINT, signal.default_int_handler)
