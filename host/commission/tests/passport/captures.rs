//! Passports from recorded traffic.
