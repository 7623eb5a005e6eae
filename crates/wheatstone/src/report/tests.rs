//! Reports of small synthetic worlds.
