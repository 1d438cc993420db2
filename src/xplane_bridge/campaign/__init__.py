"""Campaigns: thousands of flights of one scenario in process, with parameters drawn anew for each."""
