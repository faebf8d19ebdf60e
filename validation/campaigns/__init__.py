"""Campaigns: sweeps over cases, engines and parameters from one file, run on this machine or on a cluster."""
