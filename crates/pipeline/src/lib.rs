//! Wires the nemoral stages into typed plans that grow a forest and record it.
