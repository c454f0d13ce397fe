"""Learning on the paper's construction site: its DQN, its two layers, its scenarios, and the baselines."""
