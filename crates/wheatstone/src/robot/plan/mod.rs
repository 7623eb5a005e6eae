//! A way over the map to the goal.
