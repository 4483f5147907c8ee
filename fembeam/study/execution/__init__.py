"""How many runs are done: in which processes, kept where, and told apart by what they compute."""
