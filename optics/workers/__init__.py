"""Many pieces of work on processes of this machine or of a cluster: one that dies takes nothing with it."""
