"""The paper of Zhu, Pauwels and de Vries (2021): its environment, its learning, its pictures."""
