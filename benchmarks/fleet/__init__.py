"""Many pumps: what a job costs, and how many workers keep up with the queue of jobs."""
