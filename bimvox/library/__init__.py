"""The functions that ``import bimvox`` offers: few verbs, values in and out, files only if asked."""
