"""Plans many sites, seeds or what-ifs in one command, in processes on this machine or on a cluster."""
