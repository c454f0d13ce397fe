"""The values that planning, motion, proof, log and pictures share."""
