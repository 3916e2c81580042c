"""What is left on the disk when a process is killed while it writes, or the disk is full."""
