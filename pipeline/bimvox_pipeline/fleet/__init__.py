"""Many sites, seeds or what-ifs planned in one command, in processes of this machine or on a cluster."""
