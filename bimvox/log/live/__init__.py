"""Growing logs and live viewers, while a plan is carried out."""
