"""Supply chain: are the installed packages those of the lock file, and what is a wheel made of."""
