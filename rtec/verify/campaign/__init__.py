"""Plans of many independent jobs: what is tried, where it is run, what is kept, what it says."""
