//! Faults of data: what is wrong with correspondences, where, and what to do about it.
