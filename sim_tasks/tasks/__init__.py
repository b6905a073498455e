"""Tasks: what each builds, places, judges and rewards."""
