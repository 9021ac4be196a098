//! Placeholder head, replaced before the first commit.
#![no_std]
